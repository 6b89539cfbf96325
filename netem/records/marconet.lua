-- Wireshark dissector for captures of marconet (frames.pcapng).
--
--   wireshark -X lua_script:marconet.lua frames.pcapng        or copy it to Wireshark's folder of personal plugins
--
-- Fields come from the comment of each packet: marconet.medium, .sender, .number, .slot, .offered_ns, .on_air_ns,
-- .end_ns, .seen_ns, and for each copy .receiver, .copy, .fate, .delivered_ns, .cause. Examples of display filters:
--   marconet.sender == "r1" && marconet.fate == "lost"            marconet.medium == "radio" && marconet.slot == 7
-- Frames of user link types are shown as bytes; those that begin as MAVLink does go to a MAVLink dissector, if Wireshark
-- has one with the name mavlink_proto (pymavlink's generator writes it).

local marconet = Proto("marconet", "marconet frame")
local media = Proto("marconet_medium", "marconet medium")       -- of user link types

local f = {
    medium = ProtoField.string("marconet.medium", "Medium"),
    sender = ProtoField.string("marconet.sender", "Sender"),
    number = ProtoField.uint64("marconet.number", "Number"),
    slot = ProtoField.uint64("marconet.slot", "Slot"),
    offered_ns = ProtoField.int64("marconet.offered_ns", "Handed out [ns]"),
    on_air_ns = ProtoField.int64("marconet.on_air_ns", "First bit on the air [ns]"),
    end_ns = ProtoField.int64("marconet.end_ns", "End [ns]"),
    seen_ns = ProtoField.int64("marconet.seen_ns", "Complete at a receiver [ns]"),
    receiver = ProtoField.string("marconet.receiver", "Receiver"),
    copy = ProtoField.uint32("marconet.copy", "Copy"),
    fate = ProtoField.string("marconet.fate", "Fate"),
    delivered_ns = ProtoField.int64("marconet.delivered_ns", "Delivered [ns]"),
    cause = ProtoField.string("marconet.cause", "Cause"),
    error_frame = ProtoField.string("marconet.error_frame", "Error frame"),
}
local all = {}
for _, field in pairs(f) do all[#all + 1] = field end
marconet.fields = all

local comment_of = Field.new("frame.comment")
local interface_of = Field.new("frame.interface_name")
local NUMBERS = { number = UInt64, slot = UInt64, offered_ns = Int64, on_air_ns = Int64, end_ns = Int64, seen_ns = Int64 }

local function as_int64(text, kind)
    local low, high = 0, 0                                      -- Lua's numbers are exact up to 2^53 only
    for digit in text:gmatch("%d") do
        low = low * 10 + tonumber(digit)
        high = high * 10 + math.floor(low / 2^32)
        low = low % 2^32
    end
    return kind.new(low, high)
end

local function add_copy(tree, part)
    local receiver, copy, words = part:match("^([^:%s]+) copy (%d+): (.*)$")
    if receiver == nil then
        receiver, words = part:match("^([^:%s]+): (.*)$")
    end
    if receiver == nil then return nil end
    local cause = words:match("%((.*)%)$")
    if cause then words = words:gsub(" %(.*%)$", "") end
    local fate, at = words:match("^(.-) at (%d+) ns$")
    local branch = tree:add(f.receiver, receiver)
    if copy then branch:add(f.copy, tonumber(copy)) end
    branch:add(f.fate, fate or words)
    if at then branch:add(f.delivered_ns, as_int64(at, Int64)) end
    if cause then branch:add(f.cause, cause) end
    return receiver .. " " .. (fate or words)
end

function marconet.dissector(buffer, packet, root)
    local comment = comment_of()
    if comment == nil then return end
    local text = tostring(comment.value)
    if text:match("^error frame on ") then
        root:add(marconet):add(f.error_frame, text)
        return
    end
    if not text:match("^sender=") then return end
    local tree = root:add(marconet)
    local interface = interface_of()
    if interface then tree:add(f.medium, tostring(interface.value)) end
    local told, first, sender, number = {}, true, "", ""
    for part in (text .. " | "):gmatch("(.-) | ") do
        if first then
            for key, value in part:gmatch("(%S+)=(%S+)") do
                if key == "sender" then
                    sender = value
                    tree:add(f.sender, value)
                elseif NUMBERS[key] and value:match("^%d+$") then
                    if key == "number" then number = value end
                    tree:add(f[key], as_int64(value, NUMBERS[key]))
                end
            end
            first = false
        else
            told[#told + 1] = add_copy(tree, part)
        end
    end
    packet.cols.info:append("  [" .. sender .. " #" .. number .. " -> " .. table.concat(told, ", ") .. "]")
end

function media.dissector(buffer, packet, root)
    packet.cols.protocol = "marconet"
    packet.cols.info = buffer:len() .. " bytes"
    local start = buffer:len() > 0 and buffer(0, 1):uint() or 0
    if start == 0xFD or start == 0xFE then
        local found, mavlink = pcall(Dissector.get, "mavlink_proto")
        if found and mavlink then
            mavlink:call(buffer, packet, root)
            return
        end
    end
    Dissector.get("data"):call(buffer, packet, root)
end

local encapsulations = DissectorTable.get("wtap_encap")
for _, user in ipairs({ wtap.USER0, wtap.USER1, wtap.USER2, wtap.USER3, wtap.USER4 }) do
    encapsulations:add(user, media)
end
register_postdissector(marconet)
