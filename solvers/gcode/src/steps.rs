//! Runs a line of program flow: conditions, loops, calls and returns.

use super::expression::{bracket, expression};
use super::fault::Outcome;
use super::flow::{behind_comments, check_rest, Flow, Step};
use super::number::integer;
use super::parameters::{Scope, LOCALS};
use super::run::{Call, Exit, Runner, Target};
use super::statement::{number_label, Kind};
use super::words::Lexer;

impl Runner<'_> {
    /// Runs the step `i`; the exit, where it leaves the text.
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
}
