#include "live/search_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "counterpoint/engine/clocks.h"
#include "live/page.h"
#include "live/protocol.h"
#include "view/replay.h"

namespace counterpoint::live {
namespace {

using Json = nlohmann::ordered_json;

/// Least time between two tables of numbers, and between two motions [s].
constexpr double kRowsInterval = 0.1, kMotionInterval = 0.05;
/// Share of the time that showing motions may take while a page looks.
constexpr double kShare = 0.2;
/// Time that a page has to read the last messages [s].
constexpr double kLastWords = 2.0;

std::string controls(const SearchTexts& texts) {
  Json list = Json::array();
  for (const auto& [name, unit] : texts.numbers) list.push_back({{"name", name}, {"unit", unit}});
  return Json{{"search", {{"numbers", list}, {"reference", texts.first_is_reference}}}}.dump();
}

}  // namespace

SearchView::SearchView(Scene scene, const std::string& scene_file, const SearchTexts& texts,
                       const ServerOptions& server)
    : scene_(std::move(scene)) {
  const auto page = [&](const std::string& sources) {
    const State start{0.0, scene_.q, scene_.v};
    view::Clip clip;
    clip.states = {start};
    return live_page({scene_, start, scene_file}, view::curves_of(scene_.model, clip, {}),
                     controls(texts), sources);
  };
  server_ = std::make_unique<Server>(server, page, [this](const Event& event) {
    if (event.kind == Event::Kind::kMessage) {
      try {
        if (parse_command(event.text).kind == Command::Kind::kStop) stop_wanted_ = true;
      } catch (const InputError&) {
        // A page of another program: it gets no answer.
      }
      return;
    }
    pages_ += event.kind == Event::Kind::kOpened ? 1 : -1;
    if (event.kind == Event::Kind::kOpened) came_ = true;
  });
}

SearchView::~SearchView() { server_->drain(kLastWords); }

void SearchView::wait(double seconds, const std::function<bool()>& give_up) {
  const double end = wall_seconds() + seconds;
  while (pages_ == 0 && wall_seconds() < end && !give_up())
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

void SearchView::add(int iteration, const std::vector<double>& numbers, const std::string& words) {
  Json row = {iteration};
  for (const double number : numbers) row.push_back(number);  // not finite: null
  if (rows_.size() > 1) rows_ += ',';
  rows_ += row.dump();
  words_ = words;
  if (pages_ > 0 && (came_ || wall_seconds() >= next_rows_)) send_rows("");
}

bool SearchView::due() const { return pages_ > 0 && (came_ || wall_seconds() >= next_motion_); }

void SearchView::show(int iteration, const std::string& name, double start,
                      const SimulationOptions& options, const std::vector<VectorX>& q) {
  const double began = wall_seconds();
  came_ = false;
  scene_.options = options;
  view::Clip clip = view::clip_of_frames(scene_, start, q, view::kDefaultRate);
  clip.name = name;
  try {
    Json data = view::motion_data(scene_, clip);
    data["iteration"] = iteration;
    server_->send_frame(0, data.dump(-1, ' ', false, Json::error_handler_t::replace));
  } catch (const InputError&) {
    // A motion that a search only passes through may be farther away than a page can show.
  }
  const double now = wall_seconds();
  next_motion_ = now + std::max(kMotionInterval, (now - began) / kShare);
}

void SearchView::send_rows(const std::string& ended) {
  next_rows_ = wall_seconds() + kRowsInterval;
  const Json words = {{"words", words_}, {"ended", ended}};
  const std::string more = words.dump(-1, ' ', false, Json::error_handler_t::replace);
  server_->send_frame(1, "{\"rows\":" + rows_ + "]," + more.substr(1));
}

void SearchView::end(const std::string& words) { send_rows(words); }

std::unique_ptr<SearchView> open_search(const Scene& scene, const std::string& scene_file,
                                        const SearchTexts& texts,
                                        const std::function<bool()>& give_up) {
  constexpr double kWait = 60.0;  // [s]
  auto view = std::make_unique<SearchView>(scene, scene_file, texts);
  fmt::print(stderr, "{}\nThe search begins once the page is open, or after {} s.\n",
             view->address(), kWait);
  view->wait(kWait, give_up);
  return view;
}

}  // namespace counterpoint::live
