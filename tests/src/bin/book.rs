//! `cargo book`: the documents under `docs/` as a site of HTML pages with a search, in `target/book`.

use std::process::ExitCode;

use mdbook_driver::MDBook;

fn main() -> ExitCode {
    let root = cslam_tests::root();
    match MDBook::load(root).and_then(|book| book.build()) {
        Ok(()) => {
            println!("{}", root.join("target/book/index.html").display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("book: {error:#}");
            ExitCode::FAILURE
        }
    }
}
