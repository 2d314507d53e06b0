"""Inserts F words into the text of a program; every other byte stays the same."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from feedplan.planned_feeds.blocks import Blocks
from feedplan.planned_feeds.feeds import Feeds

# Comments, and texts for the operator, which extend to the end of the line.
_COMMENT = re.compile(rb"\([^()\r\n]*\)?|;[^\r\n]*|[Mm][ \t]*0*11[78](?![\d.])[^\r\n]*")
_LETTER = re.compile(rb"[A-Za-z]")
_TWO_WORDS = re.compile(rb"(?<![^\r\n])[ \t]*[GXYZgxyz][ \t]*[-+.\d]+([ \t]*)[A-Za-z]")
_BLANKS = b" \t\r\n\x1a"


def code_end(line: bytes) -> int:
    """The offset of the end of a line's words: after it there are only blanks and comments."""
    if b"(" not in line and b";" not in line and b"11" not in line:
        return len(line.rstrip(_BLANKS))
    return len(_COMMENT.sub(lambda found: b" " * len(found[0]), line).rstrip(_BLANKS))


def line_end(line: bytes) -> bytes:
    """The end of a line: LF, CR LF, CR or nothing."""
    return line[len(line.rstrip(b"\r\n")) :]


def blank_of(code: bytes, usual: bytes) -> bytes:
    """The blank between the words of a line (possibly empty); `usual` if it has only one word."""
    words = code.strip(_BLANKS)
    if b" " in words:
        return b" "
    if b"\t" in words:
        return b"\t"
    return b"" if len(_LETTER.findall(words)) > 1 else usual


def usual_blank(content: bytes) -> bytes:
    """The blank between the words of a program (possibly empty), from its first line with several words."""
    found = _TWO_WORDS.search(content)
    return b"" if found is None or not found[1] else b" "


def with_word(line: bytes, letter: bytes, number: bytes, usual: bytes) -> bytes:
    """A line with one more word after its words, with the line's own blanks and letter case."""
    end = code_end(line)
    code = line[:end]
    word = (letter.lower() if code.islower() else letter) + number
    return code + (blank_of(code, usual) if code.strip(_BLANKS) else b"") + word + line[end:]


def rewritten(blocks: Blocks, feeds: Feeds, replaced: Mapping[int, bytes]) -> bytes:
    """The text with these F words; `replaced` are the new texts of split lines, by index."""
    content = blocks.content
    usual = usual_blank(content)
    touched = sorted(feeds.texts.keys() | feeds.restore.keys() | feeds.modes | replaced.keys())
    index = np.array(touched, dtype=np.int64)
    begins, ends = blocks.start[index].tolist(), blocks.start[index + 1].tolist()
    numbers = blocks.feed_at[index].tolist()
    parts: list[bytes] = []
    done = 0
    for line, begin, end, (first, last) in zip(touched, begins, ends, numbers, strict=True):
        parts.append(content[done:begin])
        if line in feeds.restore:
            stop = line_end(content[begin:end]) or line_end(blocks.line(0)) or b"\n"
            parts += [b"F", feeds.restore[line], stop]
        text = feeds.texts[line][0] if line in feeds.texts else None
        if line in feeds.modes:
            parts.append(_with_mode(blocks, line, text, replaced.get(line), usual))
        elif line in replaced:
            parts.append(replaced[line])
        elif text is None:
            parts.append(content[begin:end])
        elif first >= 0:
            parts += [content[begin:first], text, content[last:end]]
        else:
            parts.append(with_word(content[begin:end], b"F", text, usual))
        done = end
    parts.append(content[done:])
    return b"".join(parts)


def _with_mode(blocks: Blocks, line: int, feed: bytes | None, replaced: bytes | None, usual: bytes) -> bytes:
    """A line with its F and with G93, which replaces a feed mode code of the line."""
    text, begin = blocks.line(line), int(blocks.start[line])
    if replaced is not None:
        first, stop, rest = replaced.partition(line_end(text) or b"\n")
        return with_word(first, b"G", b"93", usual) + stop + rest
    own = blocks.feed_at[line, 0] >= 0
    edits = [(blocks.feed_at[line], feed)] if own and feed is not None else []
    if blocks.modes[line, 0] >= 0:
        edits.append((blocks.modes[line], b"93"))
    else:
        text = with_word(text, b"G", b"93", usual)
    for (first_byte, last_byte), number in sorted(edits, key=lambda edit: -int(edit[0][0])):
        text = text[: first_byte - begin] + number + text[last_byte - begin :]
    return text if own or feed is None else with_word(text, b"F", feed, usual)
