//! Does one operation so many times and nothing else, for an instruction counter.
//!
//! `once` alone lists the operations; `once NAME COUNT` does one.

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut operations = footplate_bench::everything();
    match arguments.as_slice() {
        [] => {
            for operation in &operations {
                println!("{}", operation.name());
            }
            ExitCode::SUCCESS
        }
        [name, count] => {
            let operation = operations.iter_mut().find(|operation| operation.name() == *name);
            let (Some(operation), Ok(count)) = (operation, count.parse()) else {
                eprintln!(
                    "once: no operation `{name}`, or `{count}` is no count; without arguments it lists them"
                );
                return ExitCode::from(2);
            };
            operation.run(count);
            ExitCode::SUCCESS
        }
        _ => {
            eprintln!("usage: once [NAME COUNT]");
            ExitCode::from(2)
        }
    }
}
