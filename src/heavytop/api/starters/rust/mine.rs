//! The heavy top by TITLE: requests on standard input, answers on standard output.

use std::cell::Cell;
use std::collections::HashMap;
use std::io::{self, BufRead, Write};

/// Omega, gamma, and xi, which stays 0 where the attitude is not asked for.
type State = [f64; 9];

/// Omega' and gamma' of M' = M x Omega + P gamma x r, gamma' = gamma x Omega; M = I Omega, n = P r; xi' = xi x Omega.
fn field(i: &[f64], n: &[f64], y: &State) -> State {
    let [w1, w2, w3, g1, g2, g3, x1, x2, x3] = *y;
    [
        ((i[1] - i[2]) * w2 * w3 + g2 * n[2] - g3 * n[1]) / i[0],
        ((i[2] - i[0]) * w3 * w1 + g3 * n[0] - g1 * n[2]) / i[1],
        ((i[0] - i[1]) * w1 * w2 + g1 * n[1] - g2 * n[0]) / i[2],
        g2 * w3 - g3 * w2,
        g3 * w1 - g1 * w3,
        g1 * w2 - g2 * w1,
        x2 * w3 - x3 * w2,
        x3 * w1 - x1 * w3,
        x1 * w2 - x2 * w1,
    ]
}

// METHOD

/// Answers a request: a state for each time, then done.
fn run(given: &HashMap<String, Vec<f64>>, out: &mut impl Write) -> io::Result<()> {
    let (i, n) = (&given["inertia"], &given["moment"]);
    let control = given.get("setting").map_or(CONTROL, |value| value[0]);
    let evaluations = Cell::new(0);
    let f = |z: &State| {
        evaluations.set(evaluations.get() + 1);
        field(i, n, z)
    };
    let start = &given["state"];
    let mut y: State = std::array::from_fn(|j| start.get(j).copied().unwrap_or(0.0));
    let (mut time, mut steps, mut memory) = (0.0_f64, 0, Memory::default());
    for &end in &given["times"][1..] {
        match advance(f, &mut y, end - time, control, &mut memory) {
            Some(taken) => steps += taken,
            None => return writeln!(out, "failed step too small after time {time:e}"),
        }
        time = end;
        let numbers: Vec<String> = y[..start.len()].iter().map(|value| format!("{value:e}")).collect();
        writeln!(out, "state {time:e} {}", numbers.join(" "))?;
        out.flush()?;
    }
    writeln!(out, "done steps {steps} evaluations {}", evaluations.get())
}

fn main() -> io::Result<()> {
    let mut out = io::stdout().lock();
    let mut given = HashMap::new();
    for line in io::stdin().lock().lines() {
        let line = line?;
        let mut words = line.split_whitespace();
        match words.next() {
            Some("heavytop-integrator") => writeln!(out, "ready mine 1.0")?,
            Some("go") => run(&std::mem::take(&mut given), &mut out)?,
            Some("quit") => break,
            Some(name) => {
                given.insert(name.to_string(), words.filter_map(|word| word.parse().ok()).collect());
            }
            None => {}
        }
        out.flush()?;
    }
    Ok(())
}
