//! The preset scenes of the package.

pub const PRESETS: [&str; 6] = [
    include_str!("../../../../skate_env/scenes/paper_long_blade.toml"),
    include_str!("../../../../skate_env/scenes/paper_damped.toml"),
    include_str!("../../../../skate_env/scenes/paper_arms.toml"),
    include_str!("../../../../skate_env/scenes/blade.toml"),
    include_str!("../../../../skate_env/scenes/unilateral.toml"),
    include_str!("../../../../skate_env/scenes/paper.toml"),
];
