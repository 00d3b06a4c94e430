// The segments of a tendon from the places of its path.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "counterpoint/model/model_builder.h"

namespace counterpoint {

/// Throws InputError with the place of the tendon in a file, its name and the reason.
[[noreturn]] void fail_tendon(const TendonSpec& spec, const std::string& what);

/// Returns the body of a link and the pose of the link in its frame.
using FindLink = std::function<std::pair<int, Pose>(const std::string& link)>;

/// Fills path and wraps of `tendon` from spec.path. @throws InputError where it is no path.
void make_tendon_path(const TendonSpec& spec, const FindLink& find, Tendon& tendon);

}  // namespace counterpoint
