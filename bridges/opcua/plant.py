"""The plant as nodes: a motion device system for each line and robot, with axes and their values."""

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from math import inf
from typing import Any, Final, Protocol

from asyncua import ua

from bridges.common.mirror import Document, Mirror
from bridges.opcua.nodes import Space, Type, bad, not_supported, string, text, told
from bridges.opcua.units import engineering_unit, scale_of

FAMILIES: Final = {"rorze": ("RORZE", "RC-400", "RC-420"), "fics": ("DYNAX", "Fics", "Fics")}
"""Protocols of lines: manufacturer, controller, motion device."""
OLD_EVERY_S: Final = 1.0
STATES: Final = (
    ("Online", Type.Boolean, "online"),
    ("Moving", Type.Boolean, "moving"),
    ("Homed", Type.String, "homed"),
    ("PowerCycled", Type.Boolean, "power_cycled"),
    ("MoveId", Type.String, "move_id"),
)
"""Variables beside an axis's position: their types, and where a document has them."""
NONE: Final = {"MoveId": ""}
"""Values of states whose null is an answer, too."""


@dataclass(eq=False)
class Axis:
    """One axis: a body of a line, or an axis of a robot's unit."""

    node: str
    """Name of its node: `line1.3F`, `r1.1.X`."""
    address: str
    """Address of the body or robot, as scopes name it: `line1.3F`, `r1`."""
    path: str
    """Path of the API: `/bodies/line1.3F`, `/robots/r1/units/1`."""
    unit: str
    scale: float = 1.0
    """Pulses of one unit."""
    name: str | None = None
    """Name of a robot's axis; None: a body."""
    value: float | None = None
    read_at: datetime | None = None
    is_online: bool = False
    told: tuple[Any, ...] = field(default=())
    """Value, time and quality of its position as written last."""
    limits_known: bool = False


class Methods(Protocol):
    """Adds the methods of the plant's nodes."""

    def of_axis(self, axis: Axis, node: ua.NodeId) -> None:
        """Add those of an axis."""

    def of_unit(self, name: str, path: str, address: str, node: ua.NodeId) -> None:
        """Add those of a robot's unit."""

    def of_device(self, name: str, paths: list[str], address: str, node: ua.NodeId) -> None:
        """Add those of a line or a robot; `paths` are what its stop stops."""


class Plant:
    """Keeps the nodes as the mirror's documents are."""

    def __init__(self, space: Space, mirror: Mirror, methods: Methods, good_for_s: float) -> None:
        self._space, self._mirror, self._methods = space, mirror, methods
        self._good_for_s = good_for_s
        self.axes: dict[str, Axis] = {}
        """Axes by the names of their nodes."""
        self._by_path: dict[str, list[Axis]] = {}
        self._shapes: dict[str, tuple[Any, ...]] = {}
        """Names and units from which the nodes of a line or a robot were made."""
        self._states: dict[ua.NodeId, Any] = {}
        self._clock_ahead = timedelta()
        """Lead of this machine's clock over the gateway's clock."""
        self.is_connected: Callable[[], bool] = lambda: True
        """Tells if the gateway is connected: without it nothing is known."""

    def axes_of(self, path: str) -> list[Axis]:
        """Give the axes of a body or a unit by its path."""
        return self._by_path.get(path, [])

    async def update(self, paths: Iterable[str]) -> None:
        """Make the nodes what the documents of these paths say now."""
        documents = self._mirror.documents
        for path in paths:
            kind = path.split("/")[1]
            if kind == "lines":
                self._shape_line(documents.get(path), path)
            elif kind == "robots" and "/units/" not in path:
                self._shape_robot(documents.get(path), path)
        for path in paths:
            document = documents.get(path)
            if document is None:
                await self._lose(path)
            elif path.startswith("/bodies/"):
                await self._tell_body(path, document)
            elif "/units/" in path:
                await self._tell_unit(path, document)

    # shapes

    def _shape_line(self, line: Document | None, path: str) -> None:
        if line is not None and line.get("protocol", "rorze") != "rorze":
            return  # a robot is a device itself
        name = path.rpartition("/")[2]
        bodies = [self._mirror.documents.get(f"/bodies/{body}") for body in (line or {}).get("bodies", ())]
        known = [body for body in bodies if body is not None]
        shape = tuple((body["body_id"], body["name"], *scale_of(body)) for body in known) if line else ()
        if shape == self._shapes.get(name):
            return
        self._forget(name)
        if line is None:
            return
        self._shapes[name] = shape
        axes = self._system(
            name, name, FAMILIES["rorze"], name, [f"/bodies/{body['body_id']}" for body in known]
        )
        for body in known:
            unit, scale = scale_of(body)
            address = body["body_id"]
            axis = Axis(address, address, f"/bodies/{address}", unit, scale)
            short = address.removeprefix(f"{name}.")
            self._axis(axes, axis, short, body["name"] or short)

    def _shape_robot(self, robot: Document | None, path: str) -> None:
        name = path.rpartition("/")[2]
        units = (robot or {}).get("units", [])
        shape = tuple(
            (unit["number"], *((axis["name"], axis["unit"]) for axis in unit["axes"])) for unit in units
        )
        if robot is not None and shape == self._shapes.get(name):
            return
        self._forget(name)
        if robot is None:
            return
        self._shapes[name] = shape
        folder = self._frame(name, FAMILIES["fics"], name, [path])
        for unit in units:
            unit_name, its_path = f"{name}.{unit['number']}", f"{path}/units/{unit['number']}"
            axes, device = self._motion_device(folder, unit_name, str(unit["number"]), FAMILIES["fics"], name)
            self._methods.of_unit(unit_name, its_path, name, device)
            for axis_info in unit["axes"]:
                axis = Axis(
                    f"{unit_name}.{axis_info['name']}",
                    name,
                    its_path,
                    axis_info["unit"],
                    name=axis_info["name"],
                )
                self._axis(axes, axis, axis_info["name"], axis_info["name"])

    def _forget(self, name: str) -> None:
        if self._shapes.pop(name, None) is None:
            return
        for node in [axis for axis in self.axes if axis.startswith(f"{name}.")]:
            axis = self.axes.pop(node)
            self._by_path.pop(axis.path, None)
            self._space.remove(axis.address)
        for address in (name, f"{name}/"):
            self._space.remove(address)

    def _system(
        self, name: str, device: str, family: tuple[str, str, str], address: str, paths: list[str]
    ) -> ua.NodeId:
        folder = self._frame(name, family, address, paths)
        axes, _ = self._motion_device(folder, f"{name}.MotionDevices.{device}", device, family, address)
        return axes

    def _frame(self, name: str, family: tuple[str, str, str], address: str, paths: list[str]) -> ua.NodeId:
        """Add a MotionDeviceSystem without its motion devices; gives the folder for them."""
        space, frame = self._space, f"{address}/"
        system = space.object(
            space.device_set,
            name,
            (name, space.own),
            space.type("MotionDeviceSystemType"),
            frame,
            events=True,
        )
        folders = {
            folder: space.object(
                system,
                f"{name}.{folder}",
                (folder, space.robotics),
                ua.NodeId(ua.ObjectIds.FolderType),
                frame,
            )
            for folder in ("MotionDevices", "Controllers", "SafetyStates")
        }
        self._controller(folders["Controllers"], f"{name}.Controllers.{family[1]}", family, frame)
        self._safety(folders["SafetyStates"], f"{name}.SafetyStates.SafetyState", frame)
        self._methods.of_device(name, paths, frame, system)
        return folders["MotionDevices"]

    def _motion_device(
        self, folder: ua.NodeId, name: str, browse: str, family: tuple[str, str, str], address: str
    ) -> tuple[ua.NodeId, ua.NodeId]:
        space, frame = self._space, f"{address}/"
        device = space.object(
            folder, name, (browse, space.own), space.type("MotionDeviceType"), frame, events=True
        )
        self._nameplate(device, name, family[0], family[2], frame)
        space.property(
            device,
            f"{name}.MotionDeviceCategory",
            ("MotionDeviceCategory", space.robotics),
            ua.Variant(0, Type.Int32),  # OTHER
            frame,
            data_type=ua.NodeId(18193, space.robotics),
        )
        parameters = space.object(
            device,
            f"{name}.ParameterSet",
            ("ParameterSet", space.di),
            ua.NodeId(ua.ObjectIds.BaseObjectType),
            frame,
        )
        space.variable(
            parameters,
            f"{name}.SpeedOverride",
            ("SpeedOverride", space.robotics),
            None,
            frame,
            data_type=ua.ObjectIds.Double,
        )
        folders = [
            space.object(
                device,
                f"{name}.{folder}",
                (folder, space.robotics),
                ua.NodeId(ua.ObjectIds.FolderType),
                frame,
            )
            for folder in ("Axes", "PowerTrains")
        ]
        return folders[0], device

    def _controller(self, folder: ua.NodeId, name: str, family: tuple[str, str, str], frame: str) -> None:
        space = self._space
        controller = space.object(folder, name, (family[1], space.own), space.type("ControllerType"), frame)
        self._nameplate(controller, name, family[0], family[1], frame)
        for browse_name in ("Software", "TaskControls"):
            space.object(
                controller,
                f"{name}.{browse_name}",
                (browse_name, space.robotics),
                ua.NodeId(ua.ObjectIds.FolderType),
                frame,
            )
        user = space.object(
            controller, f"{name}.CurrentUser", ("CurrentUser", space.robotics), space.type("UserType"), frame
        )
        space.property(
            user, f"{name}.Level", ("Level", space.robotics), None, frame, data_type=ua.ObjectIds.String
        )

    def _nameplate(self, node: ua.NodeId, name: str, maker: str, model: str, frame: str) -> None:
        plates = (
            ("Manufacturer", text(maker), ua.ObjectIds.LocalizedText),
            ("Model", text(model), ua.ObjectIds.LocalizedText),
            ("ProductCode", string(model), ua.ObjectIds.String),
            ("SerialNumber", None, ua.ObjectIds.String),
        )
        for plate, value, type_ in plates:
            self._space.property(
                node, f"{name}.{plate}", (plate, self._space.di), value, frame, data_type=type_
            )

    def _safety(self, folder: ua.NodeId, name: str, frame: str) -> None:
        """Add the mandatory states of safety: the gateway knows none, and says so."""
        space = self._space
        state = space.object(folder, name, ("SafetyState", space.own), space.type("SafetyStateType"), frame)
        parameters = space.object(
            state,
            f"{name}.ParameterSet",
            ("ParameterSet", space.di),
            ua.NodeId(ua.ObjectIds.BaseObjectType),
            frame,
        )
        mode = ua.NodeId(3006, space.robotics)
        types: tuple[tuple[str, int | ua.NodeId], ...] = (
            ("OperationalMode", mode),
            ("EmergencyStop", ua.ObjectIds.Boolean),
            ("ProtectiveStop", ua.ObjectIds.Boolean),
        )
        for parameter, type_ in types:
            space.variable(
                parameters, f"{name}.{parameter}", (parameter, space.robotics), None, frame, data_type=type_
            )

    def _axis(self, folder: ua.NodeId, axis: Axis, browse: str, display: str) -> None:
        space, name, address = self._space, axis.node, axis.address
        node = space.object(
            folder,
            name,
            (browse, space.own),
            space.type("AxisType"),
            address,
            display=display,
            events=True,
        )
        space.refer(space.id(name.partition(".")[0]), node, ua.ObjectIds.Organizes)
        space.property(
            node,
            f"{name}.MotionProfile",
            ("MotionProfile", space.robotics),
            ua.Variant(0, Type.Int32),  # OTHER
            address,
            data_type=ua.NodeId(3008, space.robotics),
        )
        parameters = space.object(
            node,
            f"{name}.ParameterSet",
            ("ParameterSet", space.di),
            ua.NodeId(ua.ObjectIds.BaseObjectType),
            address,
        )
        position = space.variable(
            parameters,
            f"{name}.ActualPosition",
            ("ActualPosition", space.robotics),
            None,
            address,
            data_type=ua.ObjectIds.Double,
            type_=ua.ObjectIds.AnalogUnitType,
        )
        space.property(
            position,
            f"{name}.ActualPosition.EngineeringUnits",
            ("EngineeringUnits", 0),
            ua.Variant(engineering_unit(axis.unit), Type.ExtensionObject),
            address,
            data_type=ua.ObjectIds.EUInformation,
        )
        space.property(
            position,
            f"{name}.ActualPosition.EURange",
            ("EURange", 0),
            None,
            address,
            data_type=ua.ObjectIds.Range,
        )
        for state, type_, _ in STATES:
            space.variable(
                parameters, f"{name}.{state}", (state, space.own), None, address, data_type=type_.value
            )
        self._methods.of_axis(axis, node)
        self.axes[name] = axis
        self._by_path.setdefault(axis.path, []).append(axis)

    # values

    async def _tell_body(self, path: str, body: Document) -> None:
        line = f"/lines/{body['line_id']}"
        if path not in self._by_path:
            self._shape_line(self._mirror.documents.get(line), line)
        self._compare_clocks(body)
        for axis in self.axes_of(path):
            if scale_of(body) != (axis.unit, axis.scale):
                self._shape_line(self._mirror.documents.get(line), line)
                return await self._tell_body(path, body)
            self.note(axis, body["position"], body["position_read_at"])
            await self._tell_states(axis, body)
        return None

    def _compare_clocks(self, body: Document) -> None:
        """Age counts by the gateway's clock: it may run on another machine."""
        heard_at, age_s = body["last_heard_at"], body["known_age_s"]
        if heard_at is not None and age_s is not None:
            there = datetime.fromisoformat(heard_at) + timedelta(seconds=age_s)
            self._clock_ahead = datetime.now(UTC) - there

    async def _tell_unit(self, path: str, unit: Document) -> None:
        robot = self._mirror.documents.get(path.partition("/units/")[0], {})
        for axis in self.axes_of(path):
            await self._tell_states(axis, {**robot, **unit})

    def note(self, axis: Axis, pulses: float | None, read_at: str | None) -> None:
        """Keep a position, if it is newer than what is known."""
        if pulses is None or read_at is None:
            return
        at = datetime.fromisoformat(read_at)
        if axis.read_at is None or at >= axis.read_at:
            axis.value, axis.read_at = pulses / axis.scale, at

    async def _tell_states(self, axis: Axis, document: Document) -> None:
        axis.is_online = bool(document.get("online"))
        heard = document.get("last_heard_at")
        at = datetime.fromisoformat(heard) if heard else None
        for state, type_, key in STATES:
            value = document.get(key)
            value = NONE.get(state) if value is None else value
            known = self.is_connected() and (axis.is_online or state == "Online")
            await self._tell_state(self._space.id(f"{axis.node}.{state}"), value, type_, at, is_known=known)
        await self.tell_position(axis)

    async def _tell_state(
        self, node: ua.NodeId, value: Any, type_: ua.VariantType, at: datetime | None, *, is_known: bool
    ) -> None:
        if not is_known:
            data = bad(ua.StatusCodes.BadNoCommunication)
        elif value is None:
            data = bad(ua.StatusCodes.BadNoData)
        else:
            data = told(ua.Variant(value, type_), at)
        if self._states.get(node) != (value, is_known):
            self._states[node] = (value, is_known)
            await self._space.write(node, data)

    async def tell_position(self, axis: Axis) -> None:
        """Write a position, and how good it is."""
        status = self._quality(axis)
        news = (axis.value, axis.read_at, status)
        if news == axis.told:
            return
        axis.told = news
        code = ua.StatusCode(status)
        data = bad(status) if code.is_bad() else told(ua.Variant(axis.value, Type.Double), axis.read_at, code)
        await self._space.write(self._space.id(f"{axis.node}.ActualPosition"), data)

    def age_s(self, axis: Axis) -> float:
        """Give how old an axis's position is, in seconds."""
        if axis.read_at is None:
            return inf
        return (datetime.now(UTC) - self._clock_ahead - axis.read_at).total_seconds()

    def _quality(self, axis: Axis) -> int:
        if not axis.is_online or not self.is_connected():
            return ua.StatusCodes.BadNoCommunication
        if axis.value is None or axis.read_at is None:
            return ua.StatusCodes.BadWaitingForInitialData
        is_old = self.age_s(axis) > self._good_for_s
        return ua.StatusCodes.Good if not is_old else ua.StatusCodes.UncertainLastUsableValue

    async def _lose(self, path: str) -> None:
        for axis in self.axes_of(path):
            axis.is_online = False
            await self._tell_states(axis, {})

    async def grow_old(self) -> None:
        """Tell positions that have grown old as such, for ever."""
        while True:
            await asyncio.sleep(OLD_EVERY_S)
            for axis in list(self.axes.values()):
                await self.tell_position(axis)

    async def tell_limits(self, axis: Axis, lower: float, upper: float) -> None:
        """Tell the soft limits of an axis, in its unit."""
        limits = ua.Range(Low=lower, High=upper)
        axis.limits_known = True
        node = self._space.id(f"{axis.node}.ActualPosition.EURange")
        await self._space.write(node, told(ua.Variant(limits, Type.ExtensionObject), datetime.now(UTC)))

    async def tell_no_limits(self, axis: Axis) -> None:
        """Write that an axis's soft limits are not known."""
        axis.limits_known = True
        await self._space.write(self._space.id(f"{axis.node}.ActualPosition.EURange"), not_supported())
