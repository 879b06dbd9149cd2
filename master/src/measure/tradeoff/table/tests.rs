//! Round trips of tables, and errors with their lines.

use proptest::prelude::*;

use super::*;

fn row(setting: &str, median_ms: f64, flip: f64) -> Row {
    Row {
        setting: setting.to_owned(),
        median_ms,
        min_ms: median_ms / 2.0,
        max_error: 17,
        rmse: 1.25,
        psnr_db: 46.2,
        ssim: 0.99,
        flip,
    }
}

fn table() -> Table {
    Table {
        scene: "room, \"evening\".toml".to_owned(),
        width: 640,
        height: 480,
        threads: 2,
        simd_level: "avx2".to_owned(),
        rows: vec![row("samples-1", 10.0, 0.05), row("samples-4", 40.0, 0.01), row("worse", 50.0, 0.02)],
    }
}

fn csv_text() -> String {
    String::from_utf8(table().to_csv().unwrap()).unwrap()
}

fn refused(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("front.csv");
    std::fs::write(&path, text).unwrap();
    let message = Table::read(&path).unwrap_err().to_string();
    assert!(message.contains("front.csv"), "{message}");
    message
}

#[test]
fn the_front_is_marked_in_the_csv() {
    assert_eq!(table().front(), [0, 1]);
    let ends: Vec<char> = csv_text().lines().skip(1).filter_map(|line| line.chars().last()).collect();
    assert_eq!(ends, ['1', '1', '0']);
}

#[test]
fn columns_may_be_moved_and_added() {
    let reordered = "flip,extra,setting,scene,width,height,threads,simd_level,median_ms,min_ms,max_error,rmse,psnr_db,ssim,front\n\
                     0.5,?,samples-1,a,4,3,1,scalar,2.5,2,255,30,inf,-0.5,1\n";
    let table = Table::parse(reordered.as_bytes()).unwrap();
    assert_eq!((table.width, table.rows[0].flip, table.rows[0].psnr_db), (4, 0.5, f64::INFINITY));
}

#[test]
fn errors_name_the_line() {
    let text = csv_text();
    for (from, to, expected) in [
        ("median_ms", "ms", "no column \"median_ms\""),
        (",40,", ",0,", "line 3: column median_ms: expected a number above 0"),
        (",40,", ",NaN,", "line 3: column median_ms"),
        (",40,", ",-inf,", "line 3: column median_ms"),
        (",0.05,", ",1.5,", "line 2: column flip: expected a number from 0 to 1, but found \"1.5\""),
        (",17,", ",1.5,", "line 2: column max_error: expected a whole number"),
        (",640,", ",0,", "line 2: column width"),
        ("samples-4", "samples-1", "line 3: setting \"samples-1\" is a duplicate"),
        ("samples-4", "", "line 3: column setting: expected a name"),
    ] {
        let message = refused(&text.replacen(from, to, 1));
        assert!(message.contains(expected), "{from} -> {to}: {message}");
    }
    let other_size = text
        .lines()
        .enumerate()
        .map(|(i, line)| (if i == 3 { line.replace(",640,", ",641,") } else { line.to_owned() }) + "\n");
    assert!(refused(&other_size.collect::<String>()).contains("line 4"));
    assert!(refused("").contains("no column \"scene\""));
    assert!(refused(text.lines().next().unwrap()).contains("no rows"));
    assert!(refused(&"x".repeat(2 << 20)).contains("1048576"));
    assert!(Table::read(Path::new("nowhere.csv")).unwrap_err().to_string().contains("nowhere.csv"));
}

#[test]
fn rows_are_bounded() {
    let line = |i: usize| format!("a,4,3,1,scalar,s{i},1,1,0,0,1,1,0,0\n");
    let text = |rows: usize| COLUMNS.join(",") + "\n" + &(0..rows).map(line).collect::<String>();
    assert_eq!(Table::parse(text(MAX_ROWS).as_bytes()).unwrap().rows.len(), MAX_ROWS);
    assert!(refused(&text(MAX_ROWS + 1)).contains("1000"));
}

fn some_row() -> impl Strategy<Value = Row> {
    let numbers = (
        1e-3..1e6_f64,
        1e-3..1e6_f64,
        any::<u8>(),
        0.0..255.0_f64,
        0.0..99.0_f64,
        -1.0..1.0_f64,
        0.0..1.0_f64,
    );
    numbers.prop_map(|(median_ms, min_ms, max_error, rmse, psnr, ssim, flip)| Row {
        median_ms,
        min_ms,
        ..Row::new(String::new(), &Difference { max: max_error, differing_pixels: 0, rmse, psnr, ssim }, flip)
    })
}

proptest! {
    #[test]
    fn a_table_round_trips(
        mut rows in prop::collection::vec(some_row(), 1..20),
        scene in "[a-z,\" é]{1,20}[a-z]",
        equal: bool,
    ) {
        for (index, row) in rows.iter_mut().enumerate() {
            row.setting = format!("setting-{index}");
            if equal {
                row.psnr_db = f64::INFINITY;
            }
        }
        let scene = scene.trim().to_owned();
        let table = Table { scene, rows, ..table() };
        prop_assert_eq!(Table::parse(&table.to_csv().unwrap()).unwrap(), table);
    }

    #[test]
    fn random_bytes_are_refused(text in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Table::parse(&text).is_err());
        let after_header = [COLUMNS.join(",").as_bytes(), b"\n", &text].concat();
        let _ = Table::parse(&after_header);
    }
}
