#include "live/protocol.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

namespace counterpoint::live {
namespace {

using Json = nlohmann::ordered_json;
using Kind = Command::Kind;

static_assert(std::endian::native == std::endian::little, "frames are little-endian");

const std::map<std::string_view, Kind> kKinds = {
    {"play", Kind::kPlay},       {"pause", Kind::kPause},     {"reset", Kind::kReset},
    {"step", Kind::kStep},       {"speed", Kind::kSpeed},     {"save", Kind::kSave},
    {"restore", Kind::kRestore}, {"rewind", Kind::kRewind},   {"drag", Kind::kDrag},
    {"turn", Kind::kTurn},       {"release", Kind::kRelease}, {"input", Kind::kInput},
    {"force", Kind::kForce},     {"set", Kind::kSet},         {"record", Kind::kRecord},
    {"ghost", Kind::kGhost},     {"drive", Kind::kDrive},     {"stop", Kind::kStop}};

/// The entries of a message. Errors name the key.
class Message {
 public:
  explicit Message(const Json& json) : json_(json) {}

  double number(const char* key) const {
    const Json& value = at(key);
    if (!value.is_number() || !std::isfinite(value.get<double>())) fail(key, "a number");
    return value.get<double>();
  }
  int index(const char* key) const {
    const double value = number(key);
    if (!(value >= 0.0 && value <= 1e9) || value != std::floor(value))
      fail(key, "a whole number from 0");
    return static_cast<int>(value);
  }
  bool boolean(const char* key) const {
    if (!at(key).is_boolean()) fail(key, "true or false");
    return at(key).get<bool>();
  }
  std::string text(const char* key) const {
    if (!at(key).is_string()) fail(key, "a text");
    return at(key).get<std::string>();
  }
  Vector3 vector(const char* key) const {
    const Json& value = at(key);
    Vector3 out;
    if (!value.is_array() || value.size() != 3) fail(key, "three numbers");
    for (int i = 0; i < 3; ++i) {
      if (!value[i].is_number()) fail(key, "three numbers");
      out[i] = value[i].get<double>();
    }
    if (!out.allFinite()) fail(key, "three numbers");
    return out;
  }
  /// Returns a number, word or truth value as --option takes it.
  std::string setting(const char* key) const {
    const Json& value = at(key);
    if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
    if (value.is_number()) return Json(number(key)).dump();
    if (!value.is_string()) fail(key, "a number, a word, true or false");
    return value.get<std::string>();
  }

 private:
  const Json& at(const char* key) const {
    const auto found = json_.find(key);
    if (found == json_.end()) fail(key, "this key");
    return *found;
  }
  [[noreturn]] static void fail(const char* key, const char* expected) {
    throw InputError(std::string("message: '") + key + "': expected " + expected);
  }

  const Json& json_;
};

template <class T>
void append(const T& value, std::string& out) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void append_floats(std::initializer_list<double> values, std::string& out) {
  for (const double value : values) append(static_cast<float>(value), out);
}
void append_arrow(const Frame::Arrow& arrow, std::string& out) {
  append_floats({arrow.point.x(), arrow.point.y(), arrow.point.z(), arrow.force.x(),
                 arrow.force.y(), arrow.force.z()},
                out);
}

}  // namespace

Command parse_command(std::string_view message) {
  if (message.size() > kMaxMessage) throw InputError("message: longer than 64 kB");
  const Json json = Json::parse(message, nullptr, false);
  if (!json.is_object()) throw InputError("message: expected a JSON object");
  const Message in(json);
  const std::string word = in.text("do");
  const auto kind = kKinds.find(word);
  if (kind == kKinds.end()) throw InputError("message: 'do': expected one of the known words");
  Command out;
  out.kind = kind->second;
  switch (out.kind) {
    case Kind::kStep:
      out.index = in.index("count");
      break;
    case Kind::kSpeed:
      out.value = in.number("value");
      break;
    case Kind::kRestore:
      out.index = in.index("slot");
      break;
    case Kind::kRewind:
      out.value = in.number("time");
      break;
    case Kind::kDrag:
      out.index = in.index("body");
      out.point = in.vector("point");
      out.target = in.vector("target");
      break;
    case Kind::kTurn:
      out.index = in.index("body");
      out.target = in.vector("torque");
      break;
    case Kind::kInput:
      out.index = in.index("input");
      out.value = in.number("value");
      break;
    case Kind::kForce:
      out.index = in.index("coordinate");
      out.value = in.number("value");
      break;
    case Kind::kSet:
      out.key = in.text("key");
      out.text = in.setting("value");
      break;
    case Kind::kRecord:
    case Kind::kGhost:
      out.on = in.boolean("on");
      break;
    default:
      break;
  }
  return out;
}

std::string encode(const Frame& frame) {
  std::string out;
  out.reserve(64 + 28 * frame.poses.size() + 24 * (frame.contacts.size() + frame.closures.size()) +
              4 * frame.curves.size() + frame.rests.size() + frame.at_limit.size());
  append(static_cast<std::uint32_t>(frame.kind), out);
  append(static_cast<std::uint32_t>(frame.held_body), out);
  append(frame.time, out);
  for (const size_t count : {frame.poses.size(), frame.rests.size(), frame.contacts.size(),
                             frame.closures.size(), frame.curves.size(), size_t{0}})
    append(static_cast<std::uint32_t>(count), out);
  for (const Pose& X : frame.poses) {
    const Quaternion turn(X.rotation);
    append_floats({X.translation.x(), X.translation.y(), X.translation.z(), turn.w(), turn.x(),
                   turn.y(), turn.z()},
                  out);
  }
  for (const Frame::Arrow& arrow : frame.contacts) append_arrow(arrow, out);
  for (const Frame::Arrow& arrow : frame.closures) append_arrow(arrow, out);
  for (const double value : frame.curves) append(static_cast<float>(value), out);
  append_arrow(frame.hand, out);
  for (const std::vector<char>* flags : {&frame.rests, &frame.at_limit})
    out.append(flags->begin(), flags->end());
  return out;
}

}  // namespace counterpoint::live
