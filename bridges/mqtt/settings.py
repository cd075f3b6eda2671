"""The table `[mqtt]` of a bridge's file."""

from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field, PlainValidator, model_validator

from bridges.common.settings import BridgeFile, ExistingFile, SecretFile, Table, check_url

SCHEMES: Final = {"mqtt": 1883, "mqtts": 8883, "ws": 80, "wss": 443}
"""Ways to a broker, and the usual port of each."""


def _check_broker(text: str) -> str:
    return check_url(text, tuple(SCHEMES))


def check_topic(text: str) -> str:
    """Refuse what is no beginning of a topic."""
    segments = text.split("/")
    if not text or any(
        not segment or segment != segment.strip() or set(segment) & set("+#\0") for segment in segments
    ):
        raise ValueError(
            f"must be a topic such as acme/fab2/stocker1, without +, # and empty parts, not {text!r}"
        )
    if text.startswith("$"):
        raise ValueError("must not begin with $: such topics are the broker's own")
    return text


def _positions(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(address, str) and address for address in value):
        raise ValueError('must be an array of addresses such as ["line1.3F", "r1/units/1"]')
    return tuple(value)


def _check_id(text: str) -> str:
    if not text or set(text) & set("+/#\0"):
        raise ValueError(f"must be a part of a topic, without +, / and #, not {text!r}")
    return text


class Sparkplug(Table):
    """The node that the plant is besides, for hosts that speak Sparkplug B."""

    group: Annotated[str, AfterValidator(_check_id)]
    host: Annotated[str, AfterValidator(_check_id)] | None = None
    """The primary host: while it is offline nothing is told."""


class Mqtt(Table):
    """The broker, and what is published there."""

    url: Annotated[str, AfterValidator(_check_broker)]
    root: Annotated[str, AfterValidator(check_topic)] | None = None
    """Everything is below this topic; None: motion/ and the name of the gateway."""
    version: Literal["5", "3.1.1"] = "5"
    client_id: Annotated[str, Field(min_length=1, max_length=128)] | None = None
    """Client id at the broker; None: motion-gateway-bridge- and the name of the gateway."""
    user: str | None = None
    password_file: SecretFile | None = None
    ca_file: ExistingFile | None = None
    """The authority that signed the broker's certificate, if it is a private one."""
    cert_file: ExistingFile | None = None
    key_file: ExistingFile | None = None
    """The bridge's own certificate and its key, where the broker asks for one."""
    keepalive_s: int = Field(10, ge=2, le=3600)
    """A broker that hears nothing for half as long again tells that the bridge is gone."""
    will_delay_s: int = Field(0, ge=0, le=3600)
    """Delay in seconds before the broker tells that the bridge is gone, time for it to return; only MQTT
    5."""
    commands: bool = False
    positions: Annotated[tuple[str, ...], PlainValidator(_positions)] = ()
    """Bodies and units whose positions are published live."""
    position_rate: float = Field(1.0, ge=0.1, le=50)
    """Most position messages a second, for each body or unit."""

    sparkplug: Sparkplug | None = None

    @model_validator(mode="after")
    def _fit_together(self) -> Self:
        if (self.cert_file is None) != (self.key_file is None):
            raise ValueError("cert_file and key_file belong together")
        if self.password_file is not None and self.user is None:
            raise ValueError("password_file needs a user")
        if not self.is_tls and (self.ca_file or self.cert_file):
            raise ValueError("ca_file, cert_file and key_file need an address with mqtts:// or wss://")
        if self.will_delay_s and self.version != "5":
            raise ValueError("will_delay_s needs version 5")
        return self

    @property
    def is_tls(self) -> bool:
        """True if the connection is encrypted."""
        return urlsplit(self.url).scheme in ("mqtts", "wss")

    @property
    def place(self) -> tuple[str, int]:
        """Where the broker listens: host and port."""
        url = urlsplit(self.url)
        return str(url.hostname), url.port or SCHEMES[url.scheme]

    @property
    def websocket_path(self) -> str | None:
        """The path of a broker that is reached by WebSocket."""
        url = urlsplit(self.url)
        return (url.path or "/mqtt") if url.scheme in ("ws", "wss") else None


class MqttFile(BridgeFile):
    """The file of a bridge to MQTT."""

    mqtt: Mqtt

    @property
    def root(self) -> str:
        """The topic that everything is below."""
        return self.mqtt.root or f"motion/{self.gateway.name}"

    @property
    def client_id(self) -> str:
        """The client identifier: a broker closes an older connection that has the same one."""
        return self.mqtt.client_id or f"motion-gateway-bridge-{self.gateway.name}"

    @property
    def secret_files(self) -> list[Path]:
        """Every file that holds a secret: only the bridge's own user should be able to read it."""
        own = (self.mqtt.password_file, self.mqtt.key_file)
        return [*super().secret_files, *(file for file in own if file is not None)]
