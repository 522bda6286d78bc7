//! The preset scenes of the package.

pub const PRESETS: [&str; 6] = [
    include_str!("../../../../skate_env/scenes/paper_printed.toml"),
    include_str!("../../../../skate_env/studies/scenes/paper_damped.toml"),
    include_str!("../../../../skate_env/scenes/paper_arms.toml"),
    include_str!("../../../../skate_env/studies/scenes/blade.toml"),
    include_str!("../../../../skate_env/scenes/push_only.toml"),
    include_str!("../../../../skate_env/scenes/paper.toml"),
];
