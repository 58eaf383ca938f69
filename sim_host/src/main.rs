//! The command line, `tesaki`: see [`sim_host::cli`].

fn main() -> std::process::ExitCode {
    sim_host::cli::main()
}
