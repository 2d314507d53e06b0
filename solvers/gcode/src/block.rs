//! The words of one block of a program, and the modal groups that G and M codes belong to.
//!
//! A G code is a number of tenths (G5.1 is 51). Two codes of one group exclude each other in a block. The groups are those of
//! RS-274/NGC; a code in no group is an error.

use super::fault::Outcome;
use super::number::integer;

/// Bit of a letter in `Block::words`.
#[inline(always)]
pub const fn bit(letter: u8) -> u32 {
    1 << (letter - b'A')
}

/// Bits of several letters.
pub const fn bits(letters: &[u8]) -> u32 {
    let mut sum = 0;
    let mut i = 0;
    while i < letters.len() {
        sum |= bit(letters[i]);
        i += 1;
    }
    sum
}

/// Letters of the axes in the order of a position.
pub const AXES: [u8; 9] = *b"XYZABCUVW";

/// Bits of the words that name axes.
pub const AXIS_WORDS: u32 = bits(&AXES);

/// The axis of each letter, as an index into a position; 255 for letters that name no axis.
pub const AXIS_OF_LETTER: [u8; 26] = {
    let mut table = [255; 26];
    let mut i = 0;
    while i < AXES.len() {
        table[(AXES[i] - b'A') as usize] = i as u8;
        i += 1;
    }
    table
};

/// True for the rotary axes A, B, C.
#[inline(always)]
pub fn rotary(axis: usize) -> bool {
    (3..6).contains(&axis)
}

/// Modal groups of G codes, numbered as in the standard up to 15.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Group {
    Once = 0,
    Motion = 1,
    Plane = 2,
    Distance = 3,
    ArcDistance = 4,
    FeedMode = 5,
    Units = 6,
    Compensation = 7,
    ToolLength = 8,
    Retract = 10,
    System = 12,
    Control = 13,
    SpindleMode = 14,
    Lathe = 15,
    Shift = 16,
    Polar = 9,
    Turn = 17,
    Macro = 18,
}

const GROUPS: usize = 19;
const NO_GROUP: u8 = 255;

const GROUP_OF: [u8; 1541] = {
    let members: [(Group, &[u16]); 18] = [
        (Group::Once, &[40, 100, 280, 281, 282, 283, 284, 300, 301, 520, 530, 600, 920]),
        (
            Group::Motion,
            &[
                0, 10, 20, 30, 50, 51, 52, 53, 62, 330, 331, 730, 740, 760, 800, 810, 820, 830, 840, 850,
                860, 890,
            ],
        ),
        (Group::Plane, &[170, 180, 190]),
        (Group::Distance, &[900, 910]),
        (Group::ArcDistance, &[901, 911]),
        (Group::FeedMode, &[930, 940, 950]),
        (Group::Units, &[200, 210]),
        (Group::Compensation, &[400, 410, 411, 420, 421]),
        (Group::ToolLength, &[430, 431, 432, 434, 435, 490]),
        (Group::Retract, &[980, 990]),
        (Group::System, &[540, 541, 550, 560, 570, 580, 590, 591, 592, 593, 1540]),
        (Group::Control, &[610, 611, 640]),
        (Group::SpindleMode, &[960, 970]),
        (Group::Lathe, &[70, 80]),
        (Group::Polar, &[150, 160]),
        (Group::Shift, &[921, 922, 923]),
        (Group::Turn, &[680, 690]),
        (Group::Macro, &[650]),
    ];
    let mut table = [NO_GROUP; 1541];
    let mut i = 0;
    while i < members.len() {
        let mut j = 0;
        while j < members[i].1.len() {
            table[members[i].1[j] as usize] = members[i].0 as u8;
            j += 1;
        }
        i += 1;
    }
    table
};

/// Modal groups of M codes, numbered as in the standard from `Stop` to `Override`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum MGroup {
    /// Codes whose meaning depends on the machine; a block may have several.
    Other = 0,
    Call = 1,
    Saved = 2,
    Stop = 4,
    Output = 5,
    ToolChange = 6,
    Spindle = 7,
    Coolant = 8,
    Override = 9,
    User = 10,
}

const M_GROUPS: usize = 11;

/// The greatest number of M codes of unknown meaning in a block.
const MOST_OTHERS: usize = 4;

/// The group of an M code.
#[inline]
pub fn m_group(code: u16) -> MGroup {
    match code {
        0 | 1 | 2 | 30 | 60 => MGroup::Stop,
        6 | 61 => MGroup::ToolChange,
        3 | 4 | 5 | 19 => MGroup::Spindle,
        7..=9 => MGroup::Coolant,
        48..=53 => MGroup::Override,
        62..=68 => MGroup::Output,
        70..=73 => MGroup::Saved,
        97..=99 => MGroup::Call,
        100..=199 => MGroup::User,
        _ => MGroup::Other,
    }
}

/// The words of a block.
#[derive(Default)]
pub struct Block {
    /// Bits of the letters that the block has, other than G, M, N and O.
    pub words: u32,
    values: [f64; 26],
    groups: u32,
    codes: [u16; GROUPS],
    m_groups: u32,
    m_codes: [u16; M_GROUPS],
    others: [u16; MOST_OTHERS],
    other_count: usize,
    /// The polar words `@` and `^`: radius and angle.
    pub polar: [Option<f64>; 2],
    /// `,C` or `,R`.
    pub corner: Option<(u8, f64)>,
}

impl Block {
    /// Removes all words; their values stay in memory until they are overwritten.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.words = 0;
        self.groups = 0;
        self.m_groups = 0;
        self.other_count = 0;
        self.polar = [None; 2];
        self.corner = None;
    }

    pub fn is_empty(&self) -> bool {
        self.words == 0 && self.groups == 0 && self.m_groups == 0 && !self.is_polar()
    }

    #[inline(always)]
    pub fn is_polar(&self) -> bool {
        self.polar.iter().any(Option::is_some)
    }

    /// Removes the words of a block that has no G code and begins with an M code of unknown meaning: they are arguments of that
    /// code. With codes below M100, F, S and T stay.
    pub fn leave_to(&mut self, code: u16) {
        if self.groups == 0 {
            self.words &= if code < 100 { bits(b"FST") } else { 0 };
        }
    }

    /// M codes of unknown meaning.
    pub fn others(&self) -> &[u16] {
        &self.others[..self.other_count]
    }

    /// Adds a word with a letter A to Z; false where the block has that letter already.
    #[inline(always)]
    pub fn set(&mut self, letter: u8, value: f64) -> bool {
        let fresh = !self.has(letter);
        self.words |= bit(letter);
        self.values[(letter - b'A') as usize] = value;
        fresh
    }

    #[inline(always)]
    pub fn has(&self, letter: u8) -> bool {
        self.words & bit(letter) != 0
    }

    /// The value of a word that the block has.
    #[inline(always)]
    pub fn value(&self, letter: u8) -> f64 {
        debug_assert!(self.has(letter));
        self.values[(letter - b'A') as usize]
    }

    #[inline(always)]
    pub fn get(&self, letter: u8) -> Option<f64> {
        self.has(letter).then(|| self.value(letter))
    }

    /// The integer that a word gives, at least `least`; None where the block has no such word. `what` is for the message.
    pub fn count(&self, letter: u8, least: i64, what: &str) -> Outcome<Option<u32>> {
        let Some(value) = self.get(letter) else { return Ok(None) };
        match integer(value) {
            Some(number) if number >= least && number <= i64::from(u32::MAX) => Ok(Some(number as u32)),
            _ => fault!("word {} is no {what}: give an integer from {least}", self.word(letter)),
        }
    }

    /// The word as a message names it.
    pub fn word(&self, letter: u8) -> String {
        format!("{}{}", letter as char, self.value(letter))
    }

    /// The first polar word as a message names it.
    pub fn polar_word(&self) -> String {
        let [radius, angle] = self.polar;
        let radius = radius.map(|radius| format!("@{radius}"));
        radius.or(angle.map(|angle| format!("^{angle}"))).unwrap_or_default()
    }

    /// Adds a G code in tenths; Err with the code of its group that the block has already, or with None where the code
    /// is in no group.
    #[inline(always)]
    pub fn set_code(&mut self, code: u16) -> Result<(), Option<u16>> {
        let group = GROUP_OF.get(code as usize).copied().unwrap_or(NO_GROUP);
        if group == NO_GROUP {
            return Err(None);
        }
        if self.groups & (1 << group) != 0 {
            let other = self.codes[group as usize];
            // Some postprocessors write G80 in the same block as the motion that replaces the cycle: then the motion counts.
            match (other, code) {
                (800, _) if group == Group::Motion as u8 => {}
                (_, 800) => return Ok(()),
                _ => return Err(Some(other)),
            }
        }
        self.groups |= 1 << group;
        self.codes[group as usize] = code;
        Ok(())
    }

    #[inline(always)]
    pub fn code(&self, group: Group) -> Option<u16> {
        (self.groups & (1 << group as u8) != 0).then(|| self.codes[group as usize])
    }

    /// All G codes.
    pub fn codes(&self) -> impl Iterator<Item = u16> + '_ {
        (0..GROUPS).filter(|group| self.groups >> group & 1 == 1).map(|group| self.codes[group])
    }

    /// True where the block has no G code other than one of motion, and no M code.
    #[inline(always)]
    pub fn only_motion(&self) -> bool {
        self.groups & !(1 << Group::Motion as u8) == 0
            && self.m_groups == 0
            && !self.is_polar()
            && self.corner.is_none()
    }

    /// True where the block calls a subprogram or returns from one: by G65, M97, M98 or M99.
    #[inline(always)]
    pub fn calls(&self) -> bool {
        self.groups & (1 << Group::Macro as u8) | self.m_groups & (1 << MGroup::Call as u8) != 0
    }

    /// True where the block has no code other than that of a group.
    pub fn is_alone(&self, group: Group) -> bool {
        self.groups == 1 << group as u8 && self.m_groups == 0
    }

    /// Adds an M code of a group; Err with the code of that group that the block has already.
    pub fn set_m_code(&mut self, code: u16, group: MGroup) -> Result<(), u16> {
        if group == MGroup::Other {
            self.m_groups |= 1;
            let Some(next) = self.others.get_mut(self.other_count) else { return Err(self.others[0]) };
            *next = code;
            self.other_count += 1;
            return Ok(());
        }
        if self.m_groups & (1 << group as u8) != 0 {
            return Err(self.m_codes[group as usize]);
        }
        self.m_groups |= 1 << group as u8;
        self.m_codes[group as usize] = code;
        Ok(())
    }

    #[inline(always)]
    pub fn m_code(&self, group: MGroup) -> Option<u16> {
        (self.m_groups & (1 << group as u8) != 0).then(|| self.m_codes[group as usize])
    }
}

/// The name of a G code in tenths: G5.1.
pub fn g_name(code: u16) -> String {
    match code % 10 {
        0 => format!("G{}", code / 10),
        tenth => format!("G{}.{tenth}", code / 10),
    }
}

/// The remedy for a G code that is known but not read; None for a code that is not known.
pub fn g_remedy(code: u16) -> Option<&'static str> {
    Some(match code {
        54..=69 => "these splines are not read: post lines and arcs, or G5 to G5.3 or G6.2",
        171 | 181 | 191 => "arcs and cycles in the planes of U, V and W are not read: use G17, G18 or G19",
        380..=389 => "probing depends on the part: remove it",
        500..=519 => "scaling is not read: post the coordinates at full size",
        681..=689 => "tilted planes are each control's own: post the axes of the machine, or G43.4",
        651..=669 => "macros that each move calls are not read: call them by G65",
        700..=729 => "each control cuts this cycle in passes of its own: post the passes as single moves",
        870 => "it needs the angle at which the spindle stops: post it as single moves",
        880 => "the operator ends it by hand: post it as single moves",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_one_group_exclude_each_other() {
        let mut block = Block::default();
        assert_eq!(block.set_code(10), Ok(()));
        assert_eq!(block.set_code(910), Ok(()));
        assert_eq!(block.set_code(810), Err(Some(10)));
        assert_eq!(block.set_code(55), Err(None));
        assert_eq!(block.code(Group::Motion), Some(10));
        assert_eq!(block.set_code(800), Ok(()));
        assert_eq!(block.code(Group::Motion), Some(10));
        assert_eq!(block.set_m_code(3, MGroup::Spindle), Ok(()));
        assert_eq!(block.set_m_code(5, MGroup::Spindle), Err(3));
        block.clear();
        assert!(block.is_empty());
    }

    #[test]
    fn a_letter_stands_once() {
        let mut block = Block::default();
        assert!(block.set(b'X', 1.5));
        assert_eq!(block.get(b'X'), Some(1.5));
        assert_eq!(block.get(b'Y'), None);
        assert_eq!(block.word(b'X'), "X1.5");
        assert!(!block.set(b'X', 2.0));
    }

    #[test]
    fn codes_are_named_as_people_write_them() {
        assert_eq!(g_name(51), "G5.1");
        assert_eq!(g_name(800), "G80");
        assert_eq!(g_name(0), "G0");
    }
}
