use asperity_simulator::*; use asperity_model::*; use asperity_detect::*; use asperity_record::*;
use std::time::Instant;
fn main(){
  for (name, set, file) in [("default","parameter_set=as-coded","side-default-coded"),("ten-blocks","parameter_set=as-coded","side-n10-coded"),("load-on-driven-end","time.step_s=1e-7","side-theta-pos-dt1e-7-coded"),("beta-0225","time.step_s=1e-7","side-beta0225-dt1e-7-coded"),("default","parameter_set=as-stated","side-default-stated")] {
    let sc = Scenario::resolve(&ScenarioSource::new(name, builtin::find(name).unwrap()).with_override(set)).unwrap();
    let plan = Plan::new(&sc); let n = plan.blocks as u32; let grid=plan.grid;
    let t=Instant::now();
    let mut s = Plain::new(plan); let mut d: Vec<Box<dyn Detector>> = vec![Box::new(asperity_detect_extent::ExtentDetector::new(n))];
    let mut ev=vec![]; let mut sw=0; 
    while let Some(r)=s.next_record().unwrap(){ if let Record::Step(r)=r { sw+=r.switches.len(); d[0].observe(&r,&mut |e|ev.push(e)); } }
    d[0].finish(s.step(),&mut |e|ev.push(e));
    println!("{name} {set}: {} events {} switches {:?}", ev.len(), sw, t.elapsed());
    let text=std::fs::read_to_string(format!("/work/main/fixtures/reference/{file}.csv")).unwrap();
    let rows:Vec<&str>=text.lines().skip(1).collect(); let mut bad=0;
    for (i,(r,e)) in rows.iter().zip(&ev).enumerate(){ let e:SlipEvent=e.decode().unwrap().unwrap(); let f:Vec<f64>=r.split(',').map(|x|x.parse().unwrap()).collect();
      let ok = grid.nearest_step(f[0])==e.onset_step && e.end_step==Some(grid.nearest_step(f[1])) && f[2] as u32==e.first_block && f[3] as u32==e.last_block && f[4] as u32==e.max_sliding && (f[5]-e.ft_fn_onset).abs()<1e-7 && (f[6]-e.ft_fn_end.unwrap_or(9.)).abs()<1e-7;
      if !ok { bad+=1; if bad<4 {println!("row {i}: {r} vs {e:?}");} } }
    println!("  reference rows {} bad {}", rows.len(), bad);
  } }
