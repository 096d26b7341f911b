"""Progress of long calls."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Union

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Called with what is being done, and (done, total) of it.
Callback = Callable[[str, int, int], object]
#: ``True`` shows a bar (tqdm where it is installed), a callable is called.
Progress = Union[bool, Callback]


class _Plain:
    """A line on standard error, where tqdm is not installed."""

    def __init__(self) -> None:
        self.shown = ""

    def __call__(self, what: str, done: int, total: int) -> None:
        line = f"{what} {done}/{total}"
        sys.stderr.write("\r" + line.ljust(len(self.shown)))
        sys.stderr.flush()
        self.shown = line

    def close(self) -> None:
        if self.shown:
            sys.stderr.write("\n")


class _Tqdm:
    """A bar of tqdm for each thing that is done."""

    def __init__(self, tqdm: Any) -> None:
        self.tqdm = tqdm
        self.bar: Any = None
        self.what = ""

    def __call__(self, what: str, done: int, total: int) -> None:
        if self.bar is None or what != self.what:
            self.close()
            self.bar, self.what = self.tqdm(desc=what, total=total), what
        self.bar.total = total
        self.bar.update(done - self.bar.n)

    def close(self) -> None:
        if self.bar is not None:
            self.bar.close()
            self.bar = None


@contextmanager
def shown(progress: Progress) -> Iterator[Callback | None]:
    """The callback that an argument asks for."""
    if callable(progress):
        yield progress
        return
    if not progress:
        yield None
        return
    bar: _Plain | _Tqdm
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        bar = _Plain()
    else:
        bar = _Tqdm(tqdm)
    try:
        yield bar
    finally:
        bar.close()
