//! Puts the shipped scenes where maturin finds them, so that a wheel holds them as carom/scenes.

use std::path::Path;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let variable = |name| env::var(name).map_err(io::Error::other);
    let scenes = Path::new(&variable("CARGO_MANIFEST_DIR")?).join("../../scenes");
    let target = Path::new(&variable("OUT_DIR")?).join("scenes");
    println!("cargo::rerun-if-changed={}", scenes.display());
    if target.exists() {
        fs::remove_dir_all(&target)?;
    }
    fs::create_dir_all(&target)?;
    for entry in fs::read_dir(&scenes)? {
        let entry = entry?;
        if entry.path().is_file() {
            fs::copy(entry.path(), target.join(entry.file_name()))?;
        }
    }
    Ok(())
}
