use cslam_core::ltd::*;
use cslam_firmware::sweep_check::run;
#[test]
#[ignore]
fn probe() {
    let bytes = std::fs::read(std::env::var("DUMP").unwrap()).unwrap();
    let mut est = Estimator::<4, 8, 32, 72, 3, 8, 8, 360, 9>::new(&EstimatorConfig::default());
    let mut block: Box<cslam_firmware::front_end_check::Block> = vec![[Iq::ZERO; 512]; 32].try_into().unwrap();
    let mut out = String::new();
    run(&mut bytes.as_slice(), &mut est, &mut block, &mut (), &mut out).unwrap();
    std::fs::write("/tmp/chipw/host.txt", out).unwrap();
}
