fn main() { cslam_host_sim::accuracy::debug_scenes(20.0, 60, 1); cslam_host_sim::accuracy::debug_aod(10.0, 100, 1); }
