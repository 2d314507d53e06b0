//! Guesses the language of a file that is not understood, from words that only one language has.

/// Number of bytes at the start of a file that are searched.
const SEARCHED: usize = 1 << 16;

/// Words in capitals and the language that they belong to; the first language of which a word is found is the guess.
const SIGNS: [(&[&str], &str); 4] = [
    (&["BEGIN PGM", "TOOL CALL", "TOOL DEF", " FMAX", "CYCL DEF", "BLK FORM"], "Heidenhain conversational"),
    (
        &[
            "%_N_",
            ";$PATH",
            "DEF REAL",
            "DEF INT",
            "CYCLE8",
            "CYCLE9",
            "MSG(\"",
            "TRAFOORI",
            "TRAORI",
            "SUPA",
            "WORKPIECE(",
            "CR=",
            "=AC(",
            "=IC(",
        ],
        "Siemens Sinumerik",
    ),
    (&["M104 S", "M109 S", "M140 S", "M82\n", "M83\n", "M82\r", "M83\r", ";LAYER", "EXTRUD"], "3-D printer"),
    (&["<?XML", "<HTML", "<SVG", "SOLID ", "%!PS", "0\nSECTION", "0\r\nSECTION"], "no machine"),
];

/// The language that the file looks like; None where no word of any is found.
#[cold]
pub fn guess(source: &[u8]) -> Option<&'static str> {
    let head = source[..source.len().min(SEARCHED)].to_ascii_uppercase();
    let has = |sign: &&str| head.windows(sign.len()).any(|window| window == sign.as_bytes());
    SIGNS.iter().find(|(signs, _)| signs.iter().any(&has)).map(|&(_, language)| language)
}

#[cfg(test)]
mod tests {
    use super::guess;

    #[test]
    fn each_language_shows_itself() {
        for (text, language) in [
            ("0 BEGIN PGM 12 MM\n1 L X+5 FMAX\n", Some("Heidenhain conversational")),
            ("%_N_PART_MPF\nDEF REAL A=1\n", Some("Siemens Sinumerik")),
            ("G2 X5 CR=10\n", Some("Siemens Sinumerik")),
            ("M82\nG1 E5\n", Some("3-D printer")),
            ("G0 X1\nG1 Y2 F100\nM2\n", None),
            ("", None),
        ] {
            assert_eq!(guess(text.as_bytes()), language, "{text}");
        }
    }
}
