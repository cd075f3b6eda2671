"""Which part of a plant a scope covers, and the one check of rights that all front ends share."""

from collections.abc import Container, Iterable, Sequence
from typing import Final

from gateway.access.errors import NotPermitted
from gateway.access.principal import Principal
from gateway.access.roles import RIGHTS_OF
from gateway.core.addresses import numbered_address
from gateway.core.errors import NotFound
from gateway.core.parts import Part
from gateway.core.rights import Right
from gateway.fics.family import Fics
from gateway.rorze.family import Rorze

MOST_KNOWN: Final = 10_000
"""So many addresses, each in any case, are found at once when they come again."""


class Territory:
    """The addresses of a plant.

    A line covers its bodies, groups and robot. A command to a group, or to a SCARA robot, needs all that are
    members now. One in a scope covers the members that the configuration gives it: a group defined anew gives
    nobody more.
    """

    def __init__(self, lines: Container[str], bodies: Rorze, robots: Fics) -> None:
        self._lines, self._bodies, self._robots = lines, bodies, robots
        self._covered: dict[frozenset[str], frozenset[str]] = {}
        self._single: dict[str, Sequence[Part]] = {}
        """What addresses mean that are those of one part: of groups that changes."""
        self.learn()

    def learn(self) -> None:
        """Look anew at what scopes cover: there are other bodies, groups or robots now."""
        self._configured = {
            group.address: [Part(group.line.id, member.address) for member in group.members]
            for group in self._bodies.groups()
        }
        self._scaras = {
            scara.id: [Part(scara.line.id, member.address) for member in scara.members]
            for scara in self._bodies.scaras()
        }
        self._covered.clear()
        self._single.clear()

    def require(self, principal: Principal, right: Right, *addresses: str) -> None:
        """Refuse somebody who does not have the right on all of these; on none means on the whole plant.

        A stop takes no scope: any valid credential may stop everything.

        :raises NotPermitted: the role or the scope does not allow it; nothing was sent.
        :raises Ambiguous: an address fits several lines.
        """
        self.require_right(principal, right)
        if principal.scope is None or right in (Right.OPEN, Right.STOP):
            return
        if not addresses:
            raise NotPermitted(
                f"This is about the whole plant, and the key {principal.name} is for "
                f"{', '.join(sorted(principal.scope)) or 'nothing'}; nothing was sent.",
                "Name what is meant, or use a key without a scope.",
            ).in_japanese(
                f"設備全体に対する要求ですが、キー {principal.name} の範囲は限定されています。"
                "何も送信していません。",
                "対象を指定するか、範囲の制限がないキーを使用してください。",
            )
        for address in addresses:
            if not self.covers(principal, address):
                raise NotPermitted(
                    f"The key {principal.name} is not for {address}; nothing was sent.",
                    "Use a key whose scope has it, and all members of it if it is a group.",
                ).in_japanese(
                    f"{address} はキー {principal.name} の範囲外です。何も送信していません。",
                    "対象（グループの場合は全メンバー）を範囲に含むキーを使用してください。",
                )

    @staticmethod
    def require_right(principal: Principal, right: Right) -> None:
        """Refuse somebody whose role does not have a right at all.

        :raises NotPermitted: it does not; nothing was sent.
        """
        if right not in RIGHTS_OF[principal.role]:
            raise NotPermitted(
                f"This takes the right {right}, which the role {principal.role} of {principal.name} does not "
                "have; nothing was sent.",
                "Use a key with a higher role.",
            ).in_japanese(
                f"権限 {right} が必要ですが、{principal.name} の役割 {principal.role} にはありません。"
                "何も送信していません。",
                "より上位の役割のキーを使用してください。",
            )

    def covers(self, principal: Principal, address: str) -> bool:
        """Whether all that an address means is in somebody's scope; what there is not is in none.

        :raises Ambiguous: it fits several lines.
        """
        if principal.scope is None:
            return True
        wanted = self.parts(address)
        if not wanted:
            return False
        covered = self._covered.get(principal.scope)
        if covered is None:
            covered = frozenset(it for name in principal.scope for it in self._meant_by(name))
            self._covered[principal.scope] = covered
        for part in wanted:  # noqa: SIM110  # at each request: `all` would make a generator
            if part.address not in covered and part.line_id not in covered:
                return False
        return True

    def _meant_by(self, name: str) -> Iterable[str]:
        """The addresses that a name in a scope covers: none, if it fits nothing or several lines."""
        if name in self._scaras:
            return [part.address for part in self._scaras[name]]
        fitting = [address for address in self._configured if _fits(name, address)]
        if len(fitting) == 1:
            return [part.address for part in self._configured[fitting[0]]]
        bodies = [body.address for body in self._bodies.bodies() if _fits(name, body.address)]
        if len(bodies) == 1:
            return bodies
        return [name] if name in self._lines or self._robot(name) else []

    def parts(self, address: str) -> Sequence[Part]:
        """What an address means: the members of a group, its line where there is no such group yet.

        :raises Ambiguous: it fits several lines.
        """
        known = self._single.get(address) or self._scaras.get(address.lower())
        if known is not None:
            return known
        part = self._one(address)
        if part is None:
            return self._parts_of_group(numbered_address(address))
        if len(self._single) < MOST_KNOWN:
            self._single[address] = [part]
        return [part]

    def _one(self, address: str) -> Part | None:
        """The line, the body or the robot that an address means."""
        if address in self._lines:
            return Part(address, address)
        robot = self._robot(address.partition("/")[0])
        if robot:
            return robot
        try:
            body = self._bodies.body(address)
        except NotFound:
            return None
        return Part(body.line.id, body.address)

    def _parts_of_group(self, address: str) -> list[Part]:
        try:
            group = self._bodies.group(address)
            return [Part(group.line.id, member.address) for member in group.members]
        except NotFound:
            # To define a new group is a matter of the whole line.
            line_id = address.rpartition(".")[0]
            return [Part(line_id, line_id)] if line_id in self._lines else []

    def _robot(self, robot_id: str) -> Part | None:
        parts = (Part(robot.line.id, robot.id) for robot in self._robots.robots() if robot.id == robot_id)
        return next(parts, None)


def _fits(name: str, address: str) -> bool:
    """Whether a name, `3F` or `line1.3F`, fits an address."""
    written = numbered_address(name)
    return written == address or ("." not in written and address.endswith(f".{written}"))
