"""Registries: things of one kind by name, to which other programs may add theirs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Registry(Mapping[str, Item], Generic[Item]):
    """Things of one kind by name, in the order in which they were registered.

    Args:
        kind: what they are, in the singular, for messages.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._items: dict[str, Item] = {}

    def register(self, name: str, item: Item) -> Item:
        """Add an item and return it.

        Raises:
            ValueError: if the name is taken.
        """
        if name in self._items:
            raise ValueError(f"there is already a {self.kind} '{name}'; register yours under another name")
        self._items[name] = item
        return item

    @contextmanager
    def registered(self, name: str, item: Item) -> Iterator[Item]:
        """Add an item for as long as the block lasts.

        Raises:
            ValueError: if the name is taken.
        """
        self.register(name, item)
        try:
            yield item
        finally:
            del self._items[name]

    def __getitem__(self, name: str) -> Item:
        """The item of a name.

        Raises:
            KeyError: if there is none; its text names those that there are.
        """
        try:
            return self._items[name]
        except KeyError:
            known = ", ".join(self._items)
            raise KeyError(f"there is no {self.kind} '{name}'; there are {known}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)
