//! The sixteen butterflies of a block of 64 words in the second pass of the transform and in its inverse, as macros that give
//! string literals: see `instructions.rs`.

/// Sixteen rows of four words to sixteen columns.
macro_rules! rows_to_columns {
    () => {
        concat!(
            row_to_column!("0", "64", "128", "192"),
            row_to_column!("16", "80", "144", "208"),
            row_to_column!("32", "96", "160", "224"),
            row_to_column!("48", "112", "176", "240"),
            row_to_column!("4", "68", "132", "196"),
            row_to_column!("20", "84", "148", "212"),
            row_to_column!("36", "100", "164", "228"),
            row_to_column!("52", "116", "180", "244"),
            row_to_column!("8", "72", "136", "200"),
            row_to_column!("24", "88", "152", "216"),
            row_to_column!("40", "104", "168", "232"),
            row_to_column!("56", "120", "184", "248"),
            row_to_column!("12", "76", "140", "204"),
            row_to_column!("28", "92", "156", "220"),
            row_to_column!("44", "108", "172", "236"),
            row_to_column!("60", "124", "188", "252"),
        )
    };
}

/// Sixteen columns to sixteen rows of four words, halving.
macro_rules! columns_to_rows {
    () => {
        concat!(
            column_to_row!("shadd16", "shsub16", "0", "64", "128", "192"),
            column_to_row!("shadd16", "shsub16", "4", "68", "132", "196"),
            column_to_row!("shadd16", "shsub16", "8", "72", "136", "200"),
            column_to_row!("shadd16", "shsub16", "12", "76", "140", "204"),
            column_to_row!("shadd16", "shsub16", "16", "80", "144", "208"),
            column_to_row!("shadd16", "shsub16", "20", "84", "148", "212"),
            column_to_row!("shadd16", "shsub16", "24", "88", "152", "216"),
            column_to_row!("shadd16", "shsub16", "28", "92", "156", "220"),
            column_to_row!("shadd16", "shsub16", "32", "96", "160", "224"),
            column_to_row!("shadd16", "shsub16", "36", "100", "164", "228"),
            column_to_row!("shadd16", "shsub16", "40", "104", "168", "232"),
            column_to_row!("shadd16", "shsub16", "44", "108", "172", "236"),
            column_to_row!("shadd16", "shsub16", "48", "112", "176", "240"),
            column_to_row!("shadd16", "shsub16", "52", "116", "180", "244"),
            column_to_row!("shadd16", "shsub16", "56", "120", "184", "248"),
            column_to_row!("shadd16", "shsub16", "60", "124", "188", "252"),
        )
    };
}
