"""Makes the documentation, one page without scripts, from the OpenAPI document."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

_STYLE = """
:root { color-scheme: light dark }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem }
h2 { margin-top: 2.5rem } h3 { margin: 2rem 0 0 }
code, pre { font: 0.9em ui-monospace, monospace }
pre { overflow-x: auto; padding: 0.6rem; border: 1px solid #8886 }
b.verb { display: inline-block; min-width: 4.5rem }
table { border-collapse: collapse }
td { padding: 0.15rem 1rem 0.15rem 0; vertical-align: top }
"""


def documentation(document: Mapping[str, Any]) -> str:
    """The whole page."""
    body = "\n".join(_sections(document))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>feedplan: the service</title><style>{_STYLE}</style></head><body>\n{body}\n</body></html>\n"
    )


def _sections(document: Mapping[str, Any]) -> Iterator[str]:
    info = document["info"]
    yield f"<h1>{escape(info['title'])} {escape(info['version'])}: the service</h1>"
    for paragraph in info["description"].strip().split("\n\n"):
        yield f"<p>{_prose(paragraph)}</p>"
    yield '<p>The same for machines: <a href="/v1/openapi.json">OpenAPI</a>.</p>'
    yield "<pre>curl -F program=@part.ngc -F machine=mill http://127.0.0.1:8000/v1/jobs</pre>"
    by_tag: dict[str, list[str]] = {}
    for address, operations in document["paths"].items():
        for verb, operation in operations.items():
            by_tag.setdefault(operation["tags"][0], []).append(_operation(verb, address, operation))
    for tag, parts in by_tag.items():
        yield f"<h2>{escape(tag.capitalize())}</h2>"
        yield from parts
    yield "<h2>What is sent and answered</h2>"
    for name, schema in document["components"]["schemas"].items():
        yield f'<h3 id="{escape(name)}">{escape(name)}</h3><p>{_prose(schema.get("description", ""))}</p>'
        yield _table(
            (_code(key), _type(own), _prose(own.get("description", "")))
            for key, own in schema.get("properties", {}).items()
        )


def _operation(verb: str, address: str, operation: Mapping[str, Any]) -> str:
    told = f"{_prose(operation.get('summary', ''))}. {_prose(operation.get('description', ''))}"
    parts = [
        f'<h3><b class="verb">{verb.upper()}</b> <code>{escape(address)}</code></h3><p>{told}</p>',
        _table(
            (_code(own["name"]), f"{own['in']}: {_type(own['schema'])}", _prose(own.get("description", "")))
            for own in operation.get("parameters", ())
        ),
    ]
    for media_type, sent in operation.get("requestBody", {}).get("content", {}).items():
        parts.append(f"<p>Body: {_code(media_type)}, {_type(sent['schema'])}</p>")
        examples = sent.get("examples", {}).values()
        parts += [f"<pre>{escape(json.dumps(own['value'], indent=1))}</pre>" for own in examples]
    parts.append(
        _table(
            (
                f"<b>{status}</b>",
                " ".join(map(_code, answer.get("content", {}))),
                _prose(answer["description"]),
            )
            for status, answer in sorted(operation["responses"].items())
        )
    )
    return "\n".join(parts)


def _type(schema: Mapping[str, Any]) -> str:
    """A type in a few words, with a link to its table."""
    if "$ref" in schema:
        name = escape(schema["$ref"].rpartition("/")[2])
        return f'<a href="#{name}">{name}</a>'
    if "anyOf" in schema:
        return " or ".join(_type(own) for own in schema["anyOf"])
    if "enum" in schema:
        return escape(", ".join(map(str, schema["enum"])))
    if schema.get("type") == "array":
        return f"list of {_type(schema.get('items', {}))}"
    return escape(str(schema.get("type", "object")))


def _table(rows: Iterable[Sequence[str]]) -> str:
    cells = ["".join(f"<td>{cell}</td>" for cell in row) for row in rows]
    return f"<table>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>" if cells else ""


def _code(text: str) -> str:
    return f"<code>{escape(text)}</code>"


def _prose(text: str) -> str:
    """A paragraph in which text between backquotes is shown as code."""
    parts = escape(" ".join(text.split())).split("`")
    return "".join(f"<code>{part}</code>" if k % 2 else part for k, part in enumerate(parts))
