//! Rows of series: what the adaptive solver had where its own steps end, which need not be where steps of the grid do.

use crate::payload;

payload! {
    topic: "/series",
    table: "series" [derive = Default],
    /// The slider where an accepted step of the adaptive solver ends, as solved.
    pub struct Series {
        /// The last step of the grid up to there.
        pub step: u64 [role = Step],
        /// The time there, exact, s.
        pub time_s: f64 [role = Time],
        /// Number of the solver's step, counted from 1.
        pub solver_step: u64,
        /// Its length, s.
        pub step_s: f64,
        /// Largest speed of any block, m/s.
        pub v_max_m_per_s: f64,
        /// The block that has it.
        pub v_max_block: u32 [role = Place],
        /// Moment rate `k a sum_n V_n`, N m/s; in a medium `mu dz sum_n V_n`, per metre of strike.
        pub moment_rate_n_m_per_s: f64,
    }
}

payload! {
    topic: "/series_block",
    table: "series_block" [derive = Default],
    /// One of the chosen blocks there.
    pub struct SeriesBlock {
        /// The last step of the grid up to there.
        pub step: u64 [role = Step],
        /// The time there, exact, s.
        pub time_s: f64 [role = Time],
        /// The block, counted from 1.
        pub block: u32 [role = Place],
        /// Its slip, the displacement `u_n` from the initial grid, m.
        pub slip_m: f64,
        /// Its velocity `V_n`, m/s.
        pub velocity_m_per_s: f64,
        /// Friction, N.
        pub friction_n: f64,
        /// Friction over the normal load of the block.
        pub friction_ratio: f64,
        /// State `psi_n = f_0 + b_n ln(V_0 theta_n / D_c)`, by the law prz with `2 D_c`.
        pub state: f64 [unit = "1"],
        /// The state as `theta_n`, s.
        pub theta_s: f64,
    }
}
