//! The quick cases of the verification book, one test each; `--bin book` runs the long ones too.

macro_rules! test {
    ($room:ident $case:ident quick) => {
        mod $case {
            #[test]
            fn holds() {
                tests::book::check(concat!(stringify!($room), ": ", stringify!($case)));
            }
        }
    };
    ($room:ident $case:ident long) => {};
}

macro_rules! tests_of {
    ($($room:ident: $case:ident $kind:ident;)*) => {
        $(test!($room $case $kind);)*
    };
}

tests::each_case_of_the_book!(tests_of);
