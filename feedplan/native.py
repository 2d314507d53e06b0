"""Records whose arrays are what a native object holds."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Generic, TypeVar

Record = TypeVar("Record", bound="OfNative[Any]")
Native = TypeVar("Native")


class OfNative(Generic[Native]):
    """Base of frozen dataclasses whose fields are those of `native`, arrays as read-only views of its memory.

    The native object is made where the record is, and checks it once; kernels take it from there.
    """

    native: Native

    @classmethod
    def of(cls: type[Record], native: Native, **others: Any) -> Record:
        """The record of a native object, with `others` for fields that this has not."""
        record = object.__new__(cls)
        record._hold(native, **others)
        return record

    def _hold(self, native: Native, **others: Any) -> None:
        object.__setattr__(self, "native", native)
        for name in _names(self):
            object.__setattr__(self, name, others[name] if name in others else getattr(native, name))

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        return type(self), tuple(getattr(self, name) for name in _names(self))


def _names(record: Any) -> list[str]:
    return [field.name for field in fields(record)]
