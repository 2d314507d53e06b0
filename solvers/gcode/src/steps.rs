//! Runs a line of program flow: conditions, loops, jumps, calls and returns, by O words and by the statements and calls of
//! Fanuc's macros.

use super::block::{g_name, Block, Group, MGroup};
use super::expression::{bracket, expression, number};
use super::fault::Outcome;
use super::flow::{behind_comments, check_rest, Flow, Step};
use super::number::{behind_word, integer, spaces};
use super::parameters::{Scope, LOCALS};
use super::run::{Call, Exit, Runner, Target};
use super::statement::{number_label, Kind};
use super::words::Lexer;

/// The letters of G65 that set the parameters #1 to #26; a blank where no letter does.
const ARGUMENTS: [u8; 26] = *b"ABCIJKDEF H     QRSTUVWXYZ";

impl Runner<'_> {
    /// Runs the step `i`; returns the exit if it leaves the text.
    pub fn step(&mut self, lexer: &mut Lexer, flow: &Flow, i: usize) -> Outcome<Option<Exit>> {
        let (source, steps) = (lexer.source, &flow.steps);
        let step = &steps[i];
        let past = |lexer: &mut Lexer, step: &Step| lexer.jump(step.next, step.line);
        let onto = |lexer: &mut Lexer, step: &Step| lexer.jump(step.at, step.line - 1);
        past(lexer, step);
        match step.kind {
            Kind::Sub => {
                self.defines = true;
                past(lexer, &steps[step.partner]);
            }
            Kind::EndSub | Kind::Return => {
                let value = self.value(source, step)?;
                if self.in_main() {
                    return fault!("return stands outside of subroutines: remove it");
                }
                return Ok(Some(Exit::Return(value)));
            }
            Kind::Call => return self.arguments(source, step).map(Some),
            Kind::If => {
                let mut branch = i;
                while !matches!(steps[branch].kind, Kind::Else | Kind::EndIf)
                    && !self.holds(source, &steps[branch])?
                {
                    branch = steps[branch].partner;
                }
                past(lexer, &steps[branch]);
            }
            Kind::ElseIf | Kind::Else => past(lexer, &steps[step.end]),
            Kind::While if !self.holds(source, step)? => past(lexer, &steps[step.partner]),
            Kind::DoWhile if self.holds(source, step)? => past(lexer, &steps[step.partner]),
            Kind::EndWhile => onto(lexer, &steps[step.partner]),
            Kind::Repeat => {
                let times = self.needed(source, step)?;
                match integer(times.round()) {
                    Some(times @ 1..) => self.repeats().push((i, times as u64 - 1)),
                    _ => past(lexer, &steps[step.partner]),
                }
            }
            Kind::EndRepeat => match self.repeats().last_mut() {
                Some((_, left)) if *left > 0 => {
                    *left -= 1;
                    past(lexer, &steps[step.partner]);
                }
                _ => {
                    self.repeats().pop();
                }
            },
            Kind::Break | Kind::Continue => {
                let start = step.partner;
                let stays = step.kind == Kind::Continue;
                self.repeats().retain(|&(open, _)| open < start || (stays && open == start));
                let (first, end) = (&steps[start], &steps[steps[start].end]);
                match (stays, first.kind) {
                    (false, _) => past(lexer, end),
                    (true, Kind::While) => onto(lexer, first),
                    (true, _) => onto(lexer, end),
                }
            }
            Kind::When => self.when(lexer, flow, step)?,
            Kind::GoTo => self.go_to(lexer, flow, step.arguments)?,
            Kind::EndIf | Kind::Do | Kind::DoWhile | Kind::While => {}
            Kind::Number => return fault!("an O number stands where the program goes on: end it before"),
        }
        Ok(None)
    }

    /// The value of the bracket of a step; None where it has no bracket.
    fn value(&self, source: &[u8], step: &Step) -> Outcome<Option<f64>> {
        let found = bracket(source, step.arguments, &self.interpreter)?;
        check_rest(source, found.map_or(step.arguments, |(_, end)| end))?;
        Ok(found.map(|(value, _)| value))
    }

    /// The value of the bracket that a step must have.
    fn needed(&self, source: &[u8], step: &Step) -> Outcome<f64> {
        match self.value(source, step)? {
            Some(value) => Ok(value),
            None => fault!("an O word has no [condition]: give one in brackets"),
        }
    }

    /// True where the condition of a step holds.
    fn holds(&self, source: &[u8], step: &Step) -> Outcome<bool> {
        Ok(self.needed(source, step)? != 0.0)
    }

    /// The label and the arguments of a call.
    fn arguments(&self, source: &[u8], step: &Step) -> Outcome<Exit> {
        let label = match &step.label {
            Some(label) => label.clone(),
            None => {
                let value = expression(source, step.at + 1, &self.interpreter)?;
                let Some(label) = value.and_then(|(value, _)| number_label(value)) else {
                    return fault!("the label of a call is no whole number from 0: check the parameters");
                };
                label
            }
        };
        let mut arguments = Vec::new();
        let mut at = step.arguments;
        while let Some((value, end)) = bracket(source, at, &self.interpreter)? {
            if arguments.len() == LOCALS {
                return fault!("a call has more than {LOCALS} arguments: set parameters from #31 on instead");
            }
            arguments.push(value);
            at = behind_comments(source, end);
        }
        check_rest(source, at)?;
        Ok(Exit::Call(Target::Label(label), Call { arguments, scope: Scope::Own, times: 1 }))
    }

    /// Runs IF [condition] GOTO or THEN.
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

    /// Runs GOTO, whose number is at the byte position `at`.
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

    /// The exit for M97, M98, M99 or G65 of the block.
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
