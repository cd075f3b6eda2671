"""Alarms of restores that did not end well, in words for a technician."""

from collections.abc import Iterator
from typing import Final

from gateway.core.alarms import Cause, Facts, words
from gateway.core.next_calls import get

RESTORE: Final = get(
    "{subject}/restores/{restore_id}", "See the record of the restore.", "復元の記録を確認します。"
)


def causes_of_restores(what: str, manual: str) -> Iterator[Cause]:
    """The ways in which a restore of a body, a robot or a line ends badly."""
    yield Cause(
        f"{what}.restore.failed",
        f"{what}.restore.failed",
        words(
            "Nobody knows what {address} holds after the restore {restore_id}. {detail}",
            "The motor did nothing because of this. Its next motion may follow other settings or positions.",
            "Compare it with the backup and restore that again before it is moved.",
        ),
        words(
            "復元{restore_id}の後、{address}の内容を確認できません。",
            "これによるモータの動作はありません。次の動作が意図しない設定や位置に従う可能性があります。",
            "動かす前にバックアップと比較し、もう一度復元してください。",
        ),
        manual,
        (RESTORE,),
        facts=_facts,
    )
    yield Cause(
        f"{what}.restore.differs",
        f"{what}.restore.differs",
        words(
            "{address} was read back after the restore {restore_id} and is not as in the backup.",
            "The motor did nothing because of this. Its next motion may follow other settings or positions.",
            "See the differences in the record, and settle them before it is moved.",
        ),
        words(
            "復元{restore_id}の後に読み出した{address}の内容が、バックアップと一致しません。",
            "これによるモータの動作はありません。次の動作が意図しない設定や位置に従う可能性があります。",
            "記録の相違点を確認し、動かす前に解消してください。",
        ),
        manual,
        (RESTORE,),
        facts=_facts,
    )


def _facts(record: Facts) -> Facts:
    return {
        "restore_id": record["id"],
        "request_id": record["request_id"],
        "detail": (record["error"] or {}).get("detail", ""),
    }
