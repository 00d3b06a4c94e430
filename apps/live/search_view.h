// The motions that a search goes through, shown in a browser while it runs: `optimize --live`,
// `explain --live` (docs/reference/live.md, Searches).
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/scene.h"
#include "live/server.h"
#include "live/viewer.h"

namespace counterpoint::live {

/// Texts of a search that pages show beside its motions.
struct SearchTexts {
  std::vector<std::pair<std::string, std::string>> numbers;  ///< name and unit, of every iteration
  bool first_is_reference = false;  ///< the ghost is the first motion; otherwise the last but one
};

class SearchView {
 public:
  /// Starts the server, whose page first shows the scene at its start. scene_file: for the visuals
  /// of its robots; may be empty. @throws InputError as Server does, and if this build has no
  /// pages.
  SearchView(Scene scene, const std::string& scene_file, const SearchTexts& texts,
             const ServerOptions& server = {});
  /// Pages get the last messages before they lose their server.
  ~SearchView();

  const std::string& address() const { return server_->address(); }
  /// Waits until a page looks, for at most `seconds` [s], or until give_up returns true.
  void wait(double seconds, const std::function<bool()>& give_up);
  /// True once a page has asked to end the search.
  bool stop_wanted() const { return stop_wanted_; }

  /// Adds a row of numbers; NaN: unknown. words: the state of the search. Pages get it at once if
  /// the last one is old enough.
  void add(int iteration, const std::vector<double>& numbers, const std::string& words);
  /// Whether a motion is due: a page looks, and showing motions takes little of the time.
  bool due() const;
  /// Shows a motion of the scene: its frames q, one time_step of `options` apart, the first at
  /// `start` [s]; forces by its inverse.
  void show(int iteration, const std::string& name, double start, const SimulationOptions& options,
            const std::vector<VectorX>& q);
  /// Tells pages how the search ended.
  void end(const std::string& words);

 private:
  void send_rows(const std::string& ended);

  Scene scene_;                                 ///< with the options of the last motion
  std::string rows_ = "[", words_;              ///< rows: JSON, its closing bracket left out
  double next_rows_ = 0.0, next_motion_ = 0.0;  ///< wall clock [s]
  std::atomic<int> pages_ = 0;
  std::atomic<bool> came_ = false;  ///< a page has come since the last motion
  std::atomic<bool> stop_wanted_ = false;
  std::unique_ptr<Server> server_;  ///< last, so that it ends first
};

/// Makes the view of a search, prints its address to stderr, and waits for its page for up to a
/// minute, or until give_up returns true. @throws InputError as SearchView.
std::unique_ptr<SearchView> open_search(const Scene& scene, const std::string& scene_file,
                                        const SearchTexts& texts,
                                        const std::function<bool()>& give_up);

}  // namespace counterpoint::live
