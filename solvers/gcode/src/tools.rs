//! The tool table of a program: the entry of a tool number, and what T, M6 and M61 take from it.

use super::block::Block;
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::options::Tool;

impl Interpreter<'_> {
    /// The tool of a number; None where the table does not have it or there is no table.
    pub fn tool_of(&self, number: u32) -> Option<Tool> {
        self.tools.as_ref()?.iter().find(|tool| tool.number == number).copied()
    }

    /// The tool of a number that the program needs; None where there is no table.
    pub fn needed_tool(&self, number: u32) -> Outcome<Option<Tool>> {
        match (&self.tools, self.tool_of(number)) {
            (None, _) => Ok(None),
            (Some(_), Some(tool)) => Ok(Some(tool)),
            (Some(_), None) => {
                fault!("the tool table has no tool {number}: add it there, or call another tool")
            }
        }
    }

    pub fn tool_number(&self) -> f64 {
        f64::from(self.loaded.unwrap_or(0))
    }

    /// T, M6 and M61.
    pub fn set_tool(&mut self, block: &Block, change: Option<u16>) -> Outcome<()> {
        if let Some(number) = block.count(b'T', 0, "tool number")? {
            self.selected = Some(number);
            self.moves.event(self.line, b'T', f64::from(number), [None; 2]);
        }
        let number = match change {
            Some(6) => {
                self.forget_compensation();
                self.selected
            }
            Some(_) => match block.count(b'Q', 0, "tool number")? {
                Some(number) => Some(number),
                None => return fault!("M61 names no tool: give its number as Q"),
            },
            None => return Ok(()),
        };
        self.tool = match number {
            Some(number) if number > 0 => self.needed_tool(number)?,
            _ => None,
        };
        self.loaded = number;
        Ok(())
    }
}
