//! The heavy top by the classical Runge-Kutta method: requests on standard input, answers on standard output.

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

/// y after one step of size h: replace this by your method.
fn step(f: impl Fn(&State) -> State, y: &State, h: f64) -> State {
    let moved = |k: &State, share: f64| -> State { std::array::from_fn(|j| y[j] + share * h * k[j]) };
    let k1 = f(y);
    let k2 = f(&moved(&k1, 0.5));
    let k3 = f(&moved(&k2, 0.5));
    let k4 = f(&moved(&k3, 1.0));
    let mean: State = std::array::from_fn(|j| (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j]) / 6.0);
    moved(&mean, 1.0)
}

/// Answers a request: a state for each time, then done.
fn run(given: &HashMap<String, Vec<f64>>, out: &mut impl Write) -> io::Result<()> {
    let (i, n) = (&given["inertia"], &given["moment"]);
    let h = given.get("setting").map_or(0.01, |value| value[0]);
    let start = &given["state"];
    let mut y: State = std::array::from_fn(|j| start.get(j).copied().unwrap_or(0.0));
    let (mut time, mut steps) = (0.0_f64, 0.0);
    for &end in &given["times"][1..] {
        let count = ((end - time).abs() / h).ceil();
        let length = (end - time) / count;
        for _ in 0..count as u64 {
            y = step(|z| field(i, n, z), &y, length);
        }
        time = end;
        steps += count;
        let numbers: Vec<String> = y[..start.len()].iter().map(|value| format!("{value:e}")).collect();
        writeln!(out, "state {time:e} {}", numbers.join(" "))?;
        out.flush()?;
    }
    writeln!(out, "done steps {steps} evaluations {}", 4.0 * steps)
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
