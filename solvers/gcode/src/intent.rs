//! The motion that a block asks for, by its code or by its words, and the check that each of its words has a use.

use super::block::{bit, bits, g_name, Block, Group, MGroup, AXES, AXIS_WORDS};
use super::fault::Outcome;

/// Words that need no code in their block.
pub const FREE_WORDS: u32 = bits(b"FST");

/// Words that are ignored where no code of their block uses them: E of extruders, and D of offsets on other controls.
const LEFT_OUT: u32 = bits(b"DE");

/// Words of G2 and G3 besides the axis words.
pub const ARC_WORDS: u32 = bits(b"IJKRP");

/// Codes without motion that take the axis words of their block.
const TAKES_AXES: [u16; 10] = [100, 280, 281, 282, 283, 284, 300, 301, 520, 920];

/// The axis words of a block that are coordinates. In a block with G4, X without other axis words is a time.
pub fn axis_words(block: &Block) -> u32 {
    let axes = block.words & AXIS_WORDS | if block.is_polar() { bits(b"XY") } else { 0 };
    let timed = axes == bit(b'X') && block.code(Group::Once) == Some(40) && !block.has(b'P');
    if timed && block.code(Group::Motion).is_none() {
        0
    } else {
        axes
    }
}

/// The motion that a block asks for, by its code or by its words. With `vector`, I, J, K alone turn the tool.
#[inline(always)]
pub fn motion_of(block: &Block, axes: u32, modal: u16, vector: bool) -> Outcome<Option<u16>> {
    match block.code(Group::Motion) {
        Some(code @ (0 | 10 | 20 | 30)) if block.only_motion() => Ok(Some(code)),
        None if axes != 0 && block.only_motion() && modal != 800 => Ok(Some(modal)),
        code => motion_beside_others(block, axes, modal, code, vector),
    }
}

fn motion_beside_others(
    block: &Block,
    axes: u32,
    modal: u16,
    motion: Option<u16>,
    vector: bool,
) -> Outcome<Option<u16>> {
    let once = block.code(Group::Once).filter(|code| TAKES_AXES.contains(code));
    let tool = block.code(Group::ToolLength).filter(|code| matches!(code, 431 | 432));
    let turn = block.code(Group::Turn).filter(|code| *code == 680);
    match (motion, once.or(tool).or(turn)) {
        // `G0 G28 Z0` is common: G28 takes the axis words, G0 stays in force.
        (Some(code @ (0 | 10 | 800)), Some(280..=284 | 300 | 301)) | (Some(code @ 800), Some(_)) => {
            Ok(Some(code))
        }
        (Some(code), Some(other)) => fault!(
            "words {} and {} both take axis words: put them in two blocks",
            g_name(other),
            g_name(code)
        ),
        (Some(800), None) if axes != 0 => {
            fault!("axis words stand beside G80, which ends motion: give G0 or G1 instead")
        }
        (Some(code), None) if is_cycle(code) && axes == 0 => {
            fault!("word {} has no axis words: give the place of the hole", g_name(code))
        }
        (Some(code), None) => Ok(Some(code)),
        (None, Some(_)) if once.is_some() || axes != 0 => Ok(None),
        // Fanuc's G60 is a rapid that approaches its end from one side.
        (None, None) if axes != 0 && block.code(Group::Once) == Some(600) => Ok(Some(0)),
        (None, _) if axes != 0 && modal == 800 => {
            let word = AXES.into_iter().find(|&letter| block.has(letter)).map(|letter| block.word(letter));
            let word = word.unwrap_or_else(|| block.polar_word());
            fault!("word {word} has no motion code in force: give G0 or G1 before it")
        }
        (None, _) if axes != 0 => Ok(Some(modal)),
        (None, _) if block.words & bits(b"IJK") != 0 && matches!(modal, 20 | 30) => Ok(Some(modal)),
        (None, _) if block.words & bits(b"IJK") != 0 && vector && modal != 800 => Ok(Some(modal)),
        (None, _) => Ok(None),
    }
}

/// The words that a G code takes, besides axis words.
fn words_of(code: u16) -> u32 {
    match code {
        20 | 30 => ARC_WORDS,
        330 | 331 => bits(b"K"),
        40 => bits(b"PX"),
        50 | 51 => bits(b"IJPQ"),
        52 => bits(b"PL"),
        62 => bits(b"PKRQ"),
        100 => bits(b"PLRQIJ"),
        411 | 421 => bits(b"DL"),
        // Older controls of Fanuc have one number for lengths and radii, also in the block of G41 and G42.
        410 | 420 => bits(b"DH"),
        430 | 432 | 434 | 435 | 490 => bits(b"H"),
        541 | 1540 => bits(b"P"),
        640 => bits(b"PQ"),
        680 => bits(b"R"),
        730 | 830 => bits(b"RLQPD"),
        740 | 810 | 820 | 840 | 850 | 860 | 890 => bits(b"RLP"),
        760 => bits(b"PIJKRQHELD"),
        960 => bits(b"D"),
        _ => 0,
    }
}

/// Refuses a word that no code of the block uses, since it may have a meaning that the reader does not know. Returns the bits of
/// the words that are ignored. With `directed`, I, J, K are the tool's direction.
pub fn check_use(
    block: &Block,
    axes: u32,
    motion: Option<u16>,
    absolute: bool,
    directed: bool,
) -> Outcome<u32> {
    let mut used = FREE_WORDS | axes | if directed { bits(b"IJK") } else { 0 };
    for code in block.codes().chain(motion) {
        used |= words_of(code);
    }
    if block.m_code(MGroup::User).is_some()
        || block.m_code(MGroup::Spindle) == Some(19)
        || !block.others().is_empty()
    {
        used |= bits(b"PQRL");
    }
    used |= match (block.m_code(MGroup::Output), block.m_code(MGroup::Call)) {
        (Some(_), _) => bits(b"PQLE"),
        (None, Some(_)) => bits(b"PL"),
        (None, None) => 0,
    };
    if block.m_code(MGroup::ToolChange) == Some(61) {
        used |= bit(b'Q');
    }
    if block.m_code(MGroup::Override).is_some() {
        used |= bit(b'P');
    }
    let left_out = block.words & !used & LEFT_OUT;
    let unused = block.words & !used & !LEFT_OUT;
    if unused == 0 {
        return check_together(block, motion, absolute).map(|()| left_out);
    }
    let letter = b'A' + unused.trailing_zeros() as u8;
    let remedy = match (letter, motion) {
        (b'H', _) => "put it beside G43",
        (b'K', Some(motion)) if is_cycle(motion) => "repetitions are counted by L",
        _ => "no code of the block uses it; remove it",
    };
    fault!("word {} has no meaning here: {remedy}", block.word(letter))
}

/// Refuses combinations of words that controls refuse.
fn check_together(block: &Block, motion: Option<u16>, absolute: bool) -> Outcome<()> {
    if let Some(code) = block.code(Group::System).filter(|code| matches!(code, 541 | 1540)) {
        let alone = matches!(motion, None | Some(0 | 10 | 800)) && !block.calls();
        if !alone || matches!(block.code(Group::Once), Some(40 | 100)) {
            return fault!("{} takes the P of its block: put it in a block of its own", g_name(code));
        }
    }
    match (block.code(Group::Once), motion) {
        (Some(40), Some(20 | 30)) => fault!("G4 and an arc both use P: put them in two blocks"),
        (Some(530), Some(0 | 10)) if block.is_polar() => {
            fault!("G53 takes machine coordinates and no polar words: give X and Y")
        }
        (Some(530), Some(0 | 10)) => {
            let absolute = block.code(Group::Distance).map_or(absolute, |code| code == 900);
            if absolute {
                return Ok(());
            }
            fault!("G53 takes machine coordinates and G91 is in force: give G90 in its block")
        }
        (Some(530), _) => {
            fault!("G53 goes with straight moves only: give G0 or G1 and axis words in its block")
        }
        (Some(520 | 920), _) if block.words & (AXIS_WORDS | bit(b'E')) == 0 => {
            fault!("G52 and G92 need the axes they set: give axis words")
        }
        _ => Ok(()),
    }
}

/// True for canned cycles.
pub fn is_cycle(motion: u16) -> bool {
    matches!(motion, 730 | 740 | 810..=899)
}
