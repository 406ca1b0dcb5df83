//! Repeatability.

use super::*;

#[test]
fn the_same_input_gives_the_same_bits() {
    for (model, mut draw) in trees().skip(1) {
        let n = model.dof();
        let effects = one_of_each(&mut draw, &model);
        let mut plant = Plant::new(&model, &effects, 1e-3).unwrap();
        let (q, v, tau) = (draw.numbers(n, 2.0), draw.numbers(n, 2.0), draw.numbers(n, 20.0));
        let first = run(&mut plant, &q, &v, &tau, 20);
        // Scratch that other states have been through must not show, nor a plant made anew.
        run(&mut plant, &v, &q, &draw.numbers(n, 9.0), 3);
        assert_eq!(first, run(&mut plant, &q, &v, &tau, 20));
        assert_eq!(first, run(&mut plant.clone(), &q, &v, &tau, 20));
        assert_eq!(first, run(&mut Plant::new(&model, &effects, 1e-3).unwrap(), &q, &v, &tau, 20));
        let mut rest = [vec![0.0; n], vec![f64::NAN; n]];
        let a = draw.numbers(n, 5.0);
        for rest in &mut rest {
            plant.residual(&q, &v, &a, &tau, &vec![0.1; n], rest);
            run(&mut plant, &v, &q, &tau, 3);
        }
        assert_eq!(rest[0], rest[1]);
    }
}

/// One state at a time or a long run in pieces: the plant carries nothing from step to step but the state.
#[test]
fn a_run_in_pieces_is_the_run() {
    let mut draw = Draw::new(21);
    let model = robot("arm7");
    let effects = one_of_each(&mut draw, &model);
    let mut plant = Plant::new(&model, &effects, 1e-3).unwrap();
    assert_eq!((plant.joints(), plant.dt(), plant.state_len()), (7, 1e-3, 14));
    let (q, v, tau) = (draw.numbers(7, 1.0), draw.numbers(7, 1.0), draw.numbers(7, 5.0));
    let whole = run(&mut plant, &q, &v, &tau, 40);
    let half = run(&mut plant, &q, &v, &tau, 20);
    assert_eq!(whole, run(&mut plant, &half[..7], &half[7..], &tau, 20));
}
