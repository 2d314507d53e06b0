"""Base class of dataclasses whose arrays are views of the memory of a native object."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Generic, TypeVar

Record = TypeVar("Record", bound="OfNative[Any]")
Native = TypeVar("Native")


class OfNative(Generic[Native]):
    """A frozen dataclass whose fields are those of `native`; arrays are read-only views of its memory.

    The native object is made with the record and checks the fields once; kernels take the native object.
    """

    native: Native

    @classmethod
    def of(cls: type[Record], native: Native, **others: Any) -> Record:
        """The record of a native object; `others` are the fields that the native object lacks."""
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
