//! The figures as tables.

use super::Report;
use super::jobs::JobRow;
use cli_output::table::numbers;

impl Report {
    /// Prints all tables on standard output.
    pub(super) fn print(&self) {
        self.print_kernels();
        self.print_jobs();
        self.print_scaling();
    }

    fn print_kernels(&self) {
        let links = self.kernels.first().map_or(0, |row| row.links);
        println!("\nOne thread, {links} links, processor time per rope-step:");
        let rows = self.kernels.iter().map(|row| {
            [
                row.kernel.clone(),
                row.lanes.to_string(),
                format!("{:.0}", row.still_ns),
                format!("{:.0}", row.throw_ns),
                format!("{:.0}", row.floor_far_ns),
                format!("{:.0}", row.on_floor_ns),
                format!("{:.0}", row.simulated_s_per_cpu_s),
            ]
        });
        let header = [
            "kernel",
            "ropes side by side",
            "frame still (ns)",
            "arm spline each (ns)",
            "floor far below (ns)",
            "falls on floor (ns)",
            "simulated s per CPU s",
        ];
        println!("{}", numbers(header, 0, rows));
    }

    fn print_jobs(&self) {
        println!("\nJobs on all cores:");
        let rows = self.jobs.iter().map(|row| {
            [
                format!(
                    "{}: {} x {} s at {} ms",
                    row.job,
                    row.candidates,
                    row.horizon_s,
                    1e3 * row.step_s
                ),
                format!("{:.2}", row.cpu_s),
                format!("{:.2}", row.wall_s),
                format!("{:.0}", row.rollouts_per_s),
                format!("{}/{}", row.repeated, row.diverged),
                row.kernel.clone(),
                verdict(row),
            ]
        });
        let header = [
            "job",
            "CPU (s)",
            "wall (s)",
            "rollouts per s",
            "repeated/diverged",
            "kernel",
            "limit",
        ];
        println!("{}", numbers(header, 2, rows));
    }

    fn print_scaling(&self) {
        println!("\nCost against links, one thread:");
        let rows = self.links.rows.iter().map(|row| {
            [
                row.links.to_string(),
                format!("{:.1}", row.us_per_rollout),
                format!("{:.0}", row.ns_per_rope_step),
                format!("{:.2}", row.ns_per_link_step),
                row.repeated.to_string(),
            ]
        });
        let header = [
            "links",
            "per rollout (µs)",
            "per rope-step (ns)",
            "per link-step (ns)",
            "repeated",
        ];
        println!("{}", numbers(header, 0, rows));
        println!(
            "line: {:.2} ns per link-step + {:.0} ns, R² = {:.5}",
            self.links.slope_ns_per_link_step, self.links.intercept_ns, self.links.r_squared
        );
        println!("\nCost against candidates, one thread, arm spline each:");
        let rows = self.candidates.iter().map(|row| {
            [
                row.candidates.to_string(),
                format!("{:.2}", row.ms_per_batch),
                format!("{:.1}", row.us_per_rollout),
                format!("{:.0}", row.ns_per_rope_step),
            ]
        });
        let header = [
            "candidates",
            "per batch (ms)",
            "per rollout (µs)",
            "per rope-step (ns)",
        ];
        println!("{}", numbers(header, 0, rows));
    }
}

fn verdict(row: &JobRow) -> String {
    match (row.limit_cpu_s, row.within_limit) {
        (Some(limit), Some(true)) => format!("{limit:.2} s kept"),
        (Some(limit), Some(false)) => format!("{limit:.2} s exceeded"),
        _ => "none".to_owned(),
    }
}
