//! Fanuc's macros: calls by G65, whose arguments are letters, and the statements IF, WHILE, GOTO and END.

use super::block::{g_name, Block, Group, MGroup};
use super::expression::{bracket, number};
use super::fault::Outcome;
use super::flow::{Flow, Step};
use super::number::{behind_word, integer, spaces};
use super::parameters::Scope;
use super::run::{Call, Exit, Runner, Target};
use super::words::Lexer;

/// The letters that set the parameters #1 to #26; a blank where no letter does.
const ARGUMENTS: [u8; 26] = *b"ABCIJKDEF H     QRSTUVWXYZ";

impl Runner<'_> {
    /// IF [condition] GOTO or THEN.
    pub fn when(&mut self, lexer: &mut Lexer, flow: &Flow, step: &Step) -> Outcome<()> {
        let source = lexer.source;
        let Some((value, end)) = bracket(source, step.arguments, &self.interpreter)? else {
            return fault!("IF has no [condition]: give one in brackets");
        };
        let at = spaces(source, end);
        if let Some(at) = behind_word(source, at, "GOTO") {
            if value != 0.0 {
                self.go_to(lexer, flow, at)?;
            }
        } else if let Some(at) = behind_word(source, at, "THEN") {
            // The rest of the line is a block.
            if value != 0.0 {
                lexer.jump(at, step.line - 1);
            }
        } else {
            return fault!("IF says neither GOTO nor THEN behind its condition: give one of them");
        }
        Ok(())
    }

    /// GOTO, whose number is at a place.
    pub fn go_to(&mut self, lexer: &mut Lexer, flow: &Flow, at: usize) -> Outcome<()> {
        let number = number(lexer.source, at, &self.interpreter)?;
        let Some(number) = number.and_then(|(value, _)| integer(value)) else {
            return fault!("GOTO has no whole number: give that of a line, such as GOTO 10");
        };
        let Some((at, line)) = flow.numbered(lexer.source, number, lexer.at) else {
            return fault!("GOTO {number} goes to line N{number}, which the program does not have");
        };
        self.repeats()
            .retain(|&(open, _)| (flow.steps[open].at..flow.steps[flow.steps[open].end].at).contains(&at));
        lexer.jump(at, line);
        Ok(())
    }

    /// M97, M98, M99 or G65 of the block.
    pub fn fanuc(&self) -> Outcome<Exit> {
        let block = &self.block;
        let (name, scope, arguments) = match block.code(Group::Macro) {
            Some(code) => (g_name(code), Scope::Macro, arguments_of(block)?),
            None => {
                (format!("M{}", block.m_code(MGroup::Call).unwrap_or_default()), Scope::Shared, Vec::new())
            }
        };
        let number = block.get(b'P').and_then(integer).filter(|number| *number >= 0);
        if name == "M99" {
            return match (block.has(b'P'), number) {
                (false, _) => Ok(Exit::Return(None)),
                (true, Some(number)) => Ok(Exit::Back(number)),
                (true, None) => fault!("word {} is no number of a line: check P", block.word(b'P')),
            };
        }
        let Some(number) = number else {
            return fault!("{name} calls no subprogram: give its number as P");
        };
        let times = block.count(b'L', 0, "number of calls")?.unwrap_or(1);
        let label = || number.to_string().into_bytes();
        let target = if name == "M97" { Target::Line(number) } else { Target::Label(label()) };
        Ok(Exit::Call(target, Call { arguments, scope, times }))
    }
}

/// The arguments of G65 as values of #1 to #26; NaN for a missing one.
fn arguments_of(block: &Block) -> Outcome<Vec<f64>> {
    if !block.is_alone(Group::Macro) {
        return fault!("G65 stands beside other codes: put it in a block of its own");
    }
    let value = |letter: u8| if letter == b' ' { None } else { block.get(letter) };
    Ok(ARGUMENTS.iter().map(|&letter| value(letter).unwrap_or(f64::NAN)).collect())
}
