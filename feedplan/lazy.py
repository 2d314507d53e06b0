"""`functools.cached_property` without its lock.

Before Python 3.12 all objects of a class share that lock, which is held while a value is computed: objects
wait for each other, and a process that is forked at that time waits forever. Without the lock, two threads
may compute a value twice.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar, overload

T = TypeVar("T")


class cached_property(Generic[T]):  # noqa: N801
    """A value that a method computes when it is first read; it is kept in the object."""

    def __init__(self, make: Callable[[Any], T]) -> None:
        self._make = make
        self.__doc__ = make.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> cached_property[T]: ...
    @overload
    def __get__(self, instance: object, owner: type | None = None) -> T: ...
    def __get__(self, instance: object | None, owner: type | None = None) -> cached_property[T] | T:
        if instance is None:
            return self
        # From now on Python finds the value before this descriptor.
        value: T = self._make(instance)
        instance.__dict__[self._name] = value
        return value
