//! What is written is read back to the bit, and nothing is overwritten unasked.

use gapscope_datasets::{Episode, LogErrorKind, ReadOptions, read_logs, write_csv};
use rand::RngExt;
use rand::SeedableRng;

/// Numbers of every size that a log may hold.
fn episode() -> Episode {
    let mut random = rand_pcg::Pcg64::seed_from_u64(7);
    let mut channel = |scale: i32| -> Vec<Vec<f64>> {
        let mut number = || (random.random::<f64>() - 0.5) * 10f64.powi(random.random_range(-scale..=scale));
        (0..3).map(|_| (0..200).map(|_| number()).collect()).collect()
    };
    let mut episode = Episode {
        name: "run.csv.gz".into(),
        joints: vec!["a".into(), "joint 2, the \"elbow\"".into(), "x.y".into()],
        time: (0..200).map(|k| 1.7e9 + f64::from(k) * 0.001_000_1).collect(),
        position: channel(2),
        velocity: Some(channel(3)),
        effort: channel(300),
        command: Some(channel(2)),
        effort_link: Some(channel(20)),
        temperature: Some(channel(1)),
        disturbance: Some(channel(0)),
        stamps_kept: false,
        effort_unknown: Vec::new(),
        current: None,
        voltage: None,
        enabled: None,
    };
    episode.effort[0][..6].copy_from_slice(&[0.0, -0.0, f64::MIN_POSITIVE, 5e-324, f64::MAX, 1e15]);
    episode
}

#[test]
fn what_is_written_is_read_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["run.csv.gz", "run.csv"] {
        let mut episode = episode();
        episode.name = name.into();
        let path = folder.path().join(name);
        write_csv(&path, &episode, false).unwrap();
        let (read, findings) = read_logs(&[&path], &episode.joints, &ReadOptions::default()).unwrap();
        assert!(findings.is_empty(), "{findings:?}");
        assert_eq!(read, [episode]);
        assert!(read[0].effort[0][1].is_sign_negative());
    }
    let packed = std::fs::read(folder.path().join("run.csv.gz")).unwrap();
    assert!(packed.starts_with(&[0x1f, 0x8b]));
}

#[test]
fn nothing_is_overwritten_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    std::fs::write(&path, "precious").unwrap();
    let error = write_csv(&path, &episode(), false).unwrap_err();
    assert!(error.kind == LogErrorKind::Exists && error.to_string().contains("run.csv"), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), b"precious");
    write_csv(&path, &episode(), true).unwrap();
    assert!(std::fs::read(&path).unwrap().starts_with(b"time,"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let error = write_csv(folder.path().join("no/run.csv"), &episode(), false).unwrap_err();
    assert_eq!(error.kind, LogErrorKind::CannotWrite);
}

#[test]
fn an_episode_that_no_log_can_hold_is_refused_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    let spoil: [fn(&mut Episode); 3] = [
        |episode| episode.effort[1][7] = f64::NAN,
        |episode| episode.position[0].truncate(9),
        |episode| drop(episode.position.pop()),
    ];
    for spoil in spoil {
        let mut episode = episode();
        spoil(&mut episode);
        assert_eq!(write_csv(&path, &episode, false).unwrap_err().kind, LogErrorKind::CannotWrite);
        assert!(!path.exists());
    }
}
