//! `cargo xtask attack`: the standing attack on the built command (`tests/attack`).

use std::env;

use crate::workspace::{Failure, asperity, cargo, program, root, run, target_folder};

pub(crate) fn command(further: &[String]) -> Result<(), Failure> {
    let built = ["--bin", "asperity-attack", "--example", "refuse-memory"];
    run(cargo(&["build", "--package", "xtask", "--features", "attack", "--locked"]).args(built))?;
    let name = format!("asperity-attack{}", env::consts::EXE_SUFFIX);
    let mut attack = program(target_folder().join("debug").join(name));
    attack.arg("--program").arg(asperity()?.get_program());
    attack.arg("--root").arg(root()).arg("--work").arg(target_folder().join("attack"));
    run(attack.args(further))
}
