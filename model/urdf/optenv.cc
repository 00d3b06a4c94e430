#include "counterpoint/model/urdf/optenv.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace counterpoint {

std::string expand_optenv(const std::string& text, const std::string& file,
                          std::vector<Note>& notes) {
  constexpr std::string_view kOpen = "$(optenv ";
  std::string out;
  size_t from = 0;
  for (;;) {
    const size_t open = text.find(kOpen, from);
    const size_t close = open == std::string::npos ? open : text.find(')', open);
    if (close == std::string::npos) return out.append(text, from);
    const size_t name = open + kOpen.size();
    const size_t blank = std::min(text.find(' ', name), close);
    const std::string value = blank < close ? text.substr(blank + 1, close - blank - 1) : "";
    out.append(text, from, open - from).append(value);
    const auto line =
        1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(open), '\n');
    notes.push_back({fmt::format("{}:{}", file, line),
                     fmt::format("$(optenv {} ...) is taken at its default, '{}'; expand the file "
                                 "with xacro for another value",
                                 text.substr(name, blank - name), value)});
    from = close + 1;
  }
}

}  // namespace counterpoint
