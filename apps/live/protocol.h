// Messages between a live session and its pages (docs/reference/live.md, Messages).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::live {

/// Longest message that a page may send [bytes].
inline constexpr size_t kMaxMessage = 65536;

/// Least time between frames [s].
inline constexpr double kFrameInterval = 1.0 / 60.0;

/// A message of a page.
struct Command {
  enum class Kind {
    kPlay,
    kPause,
    kReset,
    kStep,
    kSpeed,
    kSave,
    kRestore,
    kRewind,
    kDrag,
    kTurn,
    kRelease,
    kInput,
    kForce,
    kSet,
    kRecord,
    kGhost,
    kDrive,
    kStop
  };
  Kind kind = Kind::kPause;
  int index = 0;                     ///< number of steps, slot, body, input or coordinate
  double value = 0.0;                ///< speed [-], time [s], input, or force [N, N m]
  bool on = false;                   ///< value of kRecord and kGhost
  Vector3 point = Vector3::Zero();   ///< in the body frame [m]
  Vector3 target = Vector3::Zero();  ///< in W [m]; of kTurn the torque in W [N m]
  std::string key, text;             ///< an option and its value, as --option takes them
};

/// Parses a message. @throws InputError if it is not one of the specified form; numbers are finite,
/// and `index` is not negative.
Command parse_command(std::string_view message);

/// The content of a page at one time.
struct Frame {
  enum class Kind : std::uint32_t { kScene = 0, kGhost = 1 };
  struct Arrow {
    Vector3 point = Vector3::Zero(), force = Vector3::Zero();  ///< in W [m], [N]
  };
  Kind kind = Kind::kScene;
  double time = 0.0;            ///< [s]
  std::vector<Pose> poses;      ///< pose of every body, in W
  std::vector<Arrow> contacts;  ///< forces on the moving body
  std::vector<Arrow> closures;  ///< forces on body B, or on A if B is the world
  std::vector<double> curves;   ///< values, in the order of the page's curves
  int held_body = 0;            ///< body that the hand holds; 0: none
  Arrow hand = {};              ///< the hand's force, or torque [N m]
  std::vector<char> rests;      ///< flag of each tree: 1 if the last step did not change it
  std::vector<char> at_limit;   ///< flag of each body: 1 if its joint is at a limit
};

/// Returns the bytes of a frame.
std::string encode(const Frame& frame);

}  // namespace counterpoint::live
