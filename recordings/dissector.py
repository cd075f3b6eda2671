"""A dissector for Wireshark in Lua, made of the rows of the protocols: body, command, arguments, meaning."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from protocols.fics.commands import ROWS
from protocols.fics.errors import ERRORS as FICS_ERRORS
from protocols.rorze.commands import COMMANDS
from protocols.rorze.errors import ERRORS as RORZE_ERRORS

_CODE: Final = r"""
local mg = Proto("mg", "Motion controller")
local F = {
  family = ProtoField.string("mg.family", "Family"),
  body = ProtoField.string("mg.body", "Body"),
  command = ProtoField.string("mg.command", "Command"),
  arguments = ProtoField.string("mg.arguments", "Arguments"),
  meaning = ProtoField.string("mg.meaning", "Meaning"),
  error = ProtoField.string("mg.error", "Error"),
}
mg.fields = F
local interface = Field.new("frame.interface_id")
local description = Field.new("frame.interface_description")
local direction = Field.new("frame.packet_flags_direction")

local unfinished, frames = {}, {}
function mg.init() unfinished, frames = {}, {} end

local function rorze(text, sent)
  local body, code, rest = text:match("^>?&(%x%x)(...)(.*)$")
  if not body then
    body, code, rest = text:match("^>?[$#](%x)(...)(.*)$")
  end
  if not body then
    return { arguments = text, meaning = text:match("^!+$") and "clears what the far end may hold" or nil }
  end
  local error = not sent and rest:match("@(%x%x)")
  return { body = body, command = code, arguments = rest, meaning = RORZE[code],
           error = error and (error .. "h " .. (RORZE_ERRORS[error] or "")) or nil }
end

local function fics(text, sent)
  text = text:gsub("^!", ""):gsub("\n", "")
  local code, rest = text:match("^(%w%w%w) ?(.*)$")
  if not code then return { arguments = text } end
  local error = not sent and code ~= "ERR" and (rest:match("^E%d%d$") or rest:match("^%d%d%d$"))
  local sets = rest == ""
  if sent then sets = FICS_BARE[code] and rest ~= "" or rest:find("=", 1, true) end
  local meaning = sets and FICS_SET[code] or FICS_ASKED[code] or FICS_SET[code]
  return { command = code, arguments = rest, meaning = meaning,
           error = error and (error .. " " .. (FICS_ERRORS[error] or "")) or nil }
end

-- A record may hold half a frame, or several: a frame belongs to the record in which it ends.
local function cut(number, key, bytes)
  if frames[number] then return frames[number] end
  local text = (unfinished[key] or "") .. bytes
  local found = {}
  for frame, after in text:gmatch("([^\r]*)\r()") do
    found[#found + 1] = frame
    unfinished[key] = text:sub(after)
  end
  if #found == 0 then unfinished[key] = text end
  frames[number] = found
  return found
end

function mg.dissector(buffer, pinfo, tree)
  local id, way = tostring(interface()), direction()
  local sent = way ~= nil and way.value == 2
  local family = description() and description().value or "rorze"
  local read = family == "fics" and fics or rorze
  pinfo.cols.protocol = family
  local words = {}
  for _, text in ipairs(cut(pinfo.number, id .. tostring(sent), buffer:raw())) do
    local told = read(text, sent)
    local branch = tree:add(mg, buffer(), text)
    branch:add(F.family, family)
    for _, name in ipairs({ "body", "command", "arguments", "meaning", "error" }) do
      if told[name] then branch:add(F[name], told[name]) end
    end
    words[#words + 1] = (sent and "-> " or "<- ") .. text .. (told.meaning and "  " .. told.meaning or "")
  end
  pinfo.cols.info = table.concat(words, "; ")
  return buffer:len()
end

DissectorTable.get("wtap_encap"):add(wtap.USER0, mg)
"""


def dissector() -> str:
    """Write the whole script."""
    asked = {row.code: row.titles()[1] for row in ROWS if row.code and row.is_query()}
    bare = {row.code: "" for row in ROWS if row.code and row.is_query() and not row.model_fields}
    told = {row.code: row.titles()[1] for row in ROWS if row.code and not row.is_query()}
    tables = {
        "RORZE": {code: row.titles()[1] for code, row in COMMANDS.items()},
        "RORZE_ERRORS": {f"{code:02X}": row.en for code, row in RORZE_ERRORS.items()},
        "FICS_ASKED": asked,
        "FICS_BARE": bare,
        "FICS_SET": told,
        "FICS_ERRORS": {code: row.en for code, row in FICS_ERRORS.items()},
    }
    parts = (line for name, rows in tables.items() for line in _table(name, rows))
    return "\n".join(["-- Made of the rows of motion-gateway's protocols.", *parts, _CODE.strip(), ""])


def _table(name: str, rows: Mapping[str, str]) -> Iterator[str]:
    yield f"local {name} = {{"
    yield from (f"  [{_quoted([code])}] = {_quoted([text])}," for code, text in rows.items())
    yield "}"


def _quoted(texts: Iterable[str]) -> str:
    escaped = "".join(texts).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
