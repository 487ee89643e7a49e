//! Runs one case in Copper, its graph `case.ron` and its numbers `case.rs` written by run.py.
//! Usage: copper_peer ITERATIONS REPEATS CHECK_ITERATIONS; prints ns per iteration, the start-up and the check value.
use cu29::prelude::*;

mod case;
#[allow(dead_code)] // a case uses some of them
mod tasks;

#[copper_runtime(config = "case.ron")]
struct Case {}

/// CPU time of this thread, s.
fn cpu_time() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is valid, and the clock exists on Linux.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

fn run() -> CuResult<()> {
    let begin = cpu_time();
    let number = |i| std::env::args().nth(i).unwrap().parse::<usize>().unwrap();
    let log = std::env::current_exe().unwrap().with_extension("copper");
    let mut running = Case::builder().with_log_path(&log, Some(10 << 20))?.build()?.start()?;
    let startup = cpu_time() - begin;

    let mut advance = |n| (0..n).try_for_each(|_| running.run_one_iteration());
    advance(number(3))?;
    let check = tasks::CHECK.get();
    let mut fastest = f64::INFINITY;
    for _ in 0..number(2) {
        let begin = cpu_time();
        advance(number(1))?;
        fastest = fastest.min(cpu_time() - begin);
    }
    println!("{{\"step_ns\": {}, \"startup_s\": {startup}, \"check\": {check}}}", fastest / number(1) as f64 * 1e9);
    drop(running.stop()?);
    Ok(())
}

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}
