"""A page of what is ready so far, in the place of a report until this is written."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

REFRESH_S = 5  # until the page loads itself again


def page_under_way(
    title: str, paragraphs: Iterable[str], heads: Sequence[str], rows: Iterable[Sequence[str]], *, words: int = 1
) -> str:
    """A table on a page that loads itself again every `REFRESH_S` seconds.

    Args: words: columns of text, which come first; the others are numbers.
    """
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    texts = "".join(f"<p>{escape(text)}</p>" for text in paragraphs)
    return (
        f'<!doctype html><html><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta http-equiv="refresh" content="{REFRESH_S}"><style>body{{font-family:sans-serif}}'
        "td,th{padding:.2em .8em;text-align:right}"
        f"tr>:nth-child(-n+{words}){{text-align:left}}</style></head>"
        f"<body><h1>{escape(title)}</h1>{texts}<table><tr>{head}</tr>{body}</table></body></html>"
    )
