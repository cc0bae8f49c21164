//! `cargo xtask attack`: the standing attack on the built command (`tests/attack`).

use std::env;

use clap::Args;

use crate::workspace::{Failure, asperity, cargo, program, root, run, target_folder};

/// The attacks, as `tests/attack` has them.
const ATTACKS: [&str; 11] =
    ["chunks", "flips", "mixes", "studies", "pairs", "kills", "limits", "faults", "power", "memory", "soak"];

#[derive(Debug, Default, Args)]
#[command(after_help = "\
Examples:
  cargo xtask attack
  cargo xtask attack flips mixes --seed 7
  cargo xtask attack --for-s 3600
  cargo xtask attack --full

Calls the built command as any user could, with damaged files, in pairs and
short of resources, and compares the outcome with the promises of the docs:
  chunks     every chunk of genuine logs broken once: salvage keeps the others
  flips      a bit or byte changed anywhere in a log: check detects it
  mixes      chunks moved, doubled, dropped, or of two runs in one log
  studies    the same in plans and results of studies: right tables, or none
  pairs      several processes at once on one output, some of them killed
  kills      runs killed and resumed, other commands killed and repeated
  limits     full disks, few resources, inputs made to use up memory and time
  faults     each operation on a file fails in turn, with every error
  memory     each allocation is refused in turn where foreign bytes are read
  soak       random runs, killed, resumed, replayed, exported, read elsewhere
  power      the power is cut after each operation; the disk has what was synced

Each attack lists the broken promises by kind. The files of the first cases of
each kind are kept in target/attack/found, with the calls that lead to them
(what.txt). All randomness follows from the seed, which is printed; only races
between processes do not repeat. Without --for-s and --full, the attacks end
after 150 s; on a busy machine, the cases left out are listed.

Exit codes:
  0  all promises were kept
  1  a promise was broken
  2  an attack could not be made")]
pub(crate) struct AttackArguments {
    /// Which attacks [default: all, one after the other].
    #[arg(value_name = "ATTACK", value_parser = ATTACKS)]
    attacks: Vec<String>,
    /// Repeat the attacks with new seeds until this many seconds have passed.
    #[arg(long, value_name = "SECONDS")]
    for_s: Option<u64>,
    /// Use all logs of chapter 5, and ten times as many cases or more: takes some hours.
    #[arg(long)]
    full: bool,
    /// The seed of an earlier call [default: the time].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Only the case with this number, in each attack.
    #[arg(long, value_name = "N")]
    case: Option<usize>,
}

impl AttackArguments {
    /// Equal cases in every call, so that the outcome depends on the program and not on chance.
    pub(crate) fn of_ci() -> AttackArguments {
        AttackArguments { seed: Some(1), ..AttackArguments::default() }
    }
}

pub(crate) fn command(arguments: &AttackArguments) -> Result<(), Failure> {
    let &AttackArguments { ref attacks, for_s, full, seed, case } = arguments;
    run(&mut cargo(&[
        "build",
        "--package",
        "xtask",
        "--features",
        "attack",
        "--bin",
        "asperity-attack",
        "--example",
        "refuse-memory",
        "--locked",
    ]))?;
    let name = format!("asperity-attack{}", env::consts::EXE_SUFFIX);
    let mut attack = program(target_folder().join("debug").join(name));
    attack.arg("--program").arg(asperity()?.get_program());
    attack.arg("--root").arg(root()).arg("--work").arg(target_folder().join("attack"));
    let numbers = [("--for-s", for_s), ("--seed", seed), ("--case", case.map(|case| case as u64))];
    for (option, number) in numbers {
        if let Some(number) = number {
            attack.arg(option).arg(number.to_string());
        }
    }
    if full {
        attack.arg("--full");
    }
    run(attack.args(attacks))
}
