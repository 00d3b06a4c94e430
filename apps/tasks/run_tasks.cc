#include "run_tasks.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

#include "archive.h"
#include "chunks.h"
#include "counterpoint/model/spatial.h"
#include "journal.h"
#include "report/progress.h"
#include "workers.h"

namespace counterpoint::apps::tasks {
namespace {

/// Longest time that a rank leaves a message unread while its threads work; every check costs them
/// about 18 us.
constexpr std::chrono::microseconds kTick(4000);
constexpr std::chrono::microseconds kLoneTick(100'000);

/// From a rank to rank 0: more tasks are wanted; a task failed; all threads have ended. From rank
/// 0: a chunk; no more tasks; stop and drop waiting tasks.
enum class Word : char { kWant, kFailed, kEnded, kChunk, kNoMore, kStop };

/// Result of a task on its way to rank 0.
struct Parcel {
  std::int64_t number = 0;
  bool finished = true;
  std::string bytes;
  template <class Archive>
  void serialize(Archive& a) {
    a(number, finished, bytes);
  }
};

/// Message of a rank to rank 0.
struct Notice {
  Word word = Word::kEnded;
  std::int64_t wanted = 0;
  std::string error = {};
  bool bad_input = false;
  std::int64_t done = 0;             ///< tasks done since the last message
  std::vector<Parcel> parcels = {};  ///< their results, unless they are in a journal
  template <class Archive>
  void serialize(Archive& a) {
    a(word, wanted, error, bad_input, done, parcels);
  }
};

/// Answer of rank 0.
struct Answer {
  Word word = Word::kStop;
  Chunk chunk;
  template <class Archive>
  void serialize(Archive& a) {
    a(word, as_in_memory(chunk));
  }
};

using Clock = std::chrono::steady_clock;

std::string words_of(const std::exception_ptr& error, bool& bad_input) {
  try {
    std::rethrow_exception(error);
  } catch (const InputError& e) {
    bad_input = true;
    return e.what();
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "something unknown was thrown";
  }
}

}  // namespace

/// One call of run_tasks on one rank.
class TaskRun {
 public:
  TaskRun(World& world, const TaskList& list, const RunSettings& settings)
      : world_(world), list_(list), settings_(settings) {}

  Results run() {
    prepare();
    const auto start = Clock::now();
    if (settings_.compute) {
      Workers workers(results_.threads, list_, [this](std::int64_t number, Outcome&& outcome) {
        deliver(number, std::move(outcome));
      });
      if (world_.is_root())
        lead(workers);
      else
        follow(workers);
    }
    if (settings_.compute)
      results_.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (journal_) journal_->sync(true);
    share_end();
    return std::move(results_);
  }

 private:
  /// Prepares the run; an error on one rank is reported to all before any starts.
  void prepare() {
    std::string error;
    bool bad_input = false;
    try {
      const bool kept = !settings_.folder.empty();
      if (kept && settings_.compute)
        journal_ = std::make_unique<JournalWriter>(settings_.folder, list_);
      std::vector<bool> done;
      if (kept && world_.is_root()) done = JournalReader(settings_.folder, list_).done();
      results_.finished = std::count(done.begin(), done.end(), true);
      chunks_ = std::make_unique<Chunks>(list_.count, settings_.share, std::move(done));
      if (!kept && world_.is_root()) results_.kept_.resize(static_cast<std::size_t>(list_.count));
    } catch (...) {
      if (world_.size() == 1) throw;
      error = words_of(std::current_exception(), bad_input);
    }
    agree(world_, error, bad_input);
    results_.list_ = list_;
    results_.count = list_.count;
    results_.folder_ = settings_.folder;
    results_.ranks = world_.size();
    const std::int64_t most = std::max<std::int64_t>(1, list_.count);
    results_.threads = static_cast<int>(
        std::min<std::int64_t>(settings_.threads > 0 ? settings_.threads : world_.cores(), most));
  }

  /// Called by the threads.
  void deliver(std::int64_t number, Outcome&& outcome) {
    if (journal_ && outcome.finished) {
      journal_->add(number, outcome.bytes);
      ++unsent_;
      return;
    }
    const std::lock_guard lock(mutex_);
    Parcel parcel{number, outcome.finished, std::move(outcome.bytes)};
    if (world_.is_root())
      keep(std::move(parcel));
    else
      parcels_.push_back(std::move(parcel));
    ++unsent_;
  }

  void keep(Parcel&& parcel) {
    if (parcel.finished)
      results_.kept_[static_cast<std::size_t>(parcel.number)] = std::move(parcel.bytes);
    else
      results_.stopped_tasks_.emplace_back(parcel.number, std::move(parcel.bytes));
  }

  // Ranks other than 0 -----------------------------------------------------------------------

  void tell(Notice notice) {
    const std::lock_guard lock(mutex_);
    notice.done = unsent_.exchange(0);
    notice.parcels = std::exchange(parcels_, {});
    world_.send(0, Channel::kTasks, to_bytes(notice));
  }

  void follow(Workers& workers) {
    bool asked = false, failed = false;
    const auto tell_of_failure = [&] {
      if (failed || !workers.error()) return;
      failed = true;
      Notice notice{Word::kFailed};
      notice.error = words_of(workers.error(), notice.bad_input);
      tell(std::move(notice));
    };
    while (!workers.ended()) {
      workers.wait(kTick);
      if (journal_) journal_->sync();
      tell_of_failure();
      if (settings_.stop && settings_.stop()) workers.close(true);
      if (const std::int64_t wanted = workers.wanted(); !asked && wanted > 0) {
        tell({Word::kWant, wanted});
        asked = true;
      }
      asked = !listen(workers) && asked;
      if (asked && workers.wanted() > 0) std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
    tell_of_failure();  // the error may have ended the last thread since the previous check
    if (asked) obey(world_.wait(Channel::kTasks), workers);
    tell({Word::kEnded});
  }

  /// Returns true if rank 0 has answered.
  bool listen(Workers& workers) {
    const auto message = world_.receive(Channel::kTasks);
    if (!message) return false;
    obey(*message, workers);
    return true;
  }

  static void obey(const Message& message, Workers& workers) {
    const auto answer = from_bytes<Answer>(message.bytes);
    if (answer.word == Word::kChunk)
      workers.add(answer.chunk);
    else
      workers.close(answer.word == Word::kStop);
  }

  // Rank 0 -----------------------------------------------------------------------------------

  void lead(Workers& workers) {
    const std::int64_t before = results_.finished;
    const std::int64_t total = chunks_->left();
    Progress progress(list_.name, total, 1.0, "tasks");
    int others = world_.size() - 1;
    while (others > 0 || !workers.ended()) {
      workers.wait(world_.size() > 1 ? kTick : kLoneTick);
      if (journal_) journal_->sync();
      notice(workers);
      while (const auto message = world_.receive(Channel::kTasks)) hear(*message, others);
      if (const std::int64_t wanted = workers.wanted(); wanted > 0) {
        const Chunk chunk = next(wanted);
        if (chunk.empty())
          workers.close(stopping_);
        else
          workers.add(chunk);
      }
      if (stopping_) workers.close(true);
      done_elsewhere_ += unsent_.exchange(0);
      progress.update(static_cast<double>(done_elsewhere_) + under_way(workers));
    }
    notice_error(workers);  // the error may have ended the last thread since the previous check
    done_elsewhere_ += unsent_.exchange(0);
    results_.computed = done_elsewhere_;
    results_.finished =
        before + done_elsewhere_ - static_cast<std::int64_t>(results_.stopped_tasks_.size());
  }

  /// Progress of the tasks in work in this process, in units of tasks.
  double under_way(const Workers& workers) const {
    return list_.work ? std::max(0.0, list_.work() - static_cast<double>(workers.done())) : 0.0;
  }

  Chunk next(std::int64_t wanted) {
    return stopping_ ? Chunk() : chunks_->next(wanted, world_.size());
  }

  /// Records an error of this rank.
  void notice_error(const Workers& workers) {
    if (!failure_.empty() || !workers.error()) return;
    first_error_ = workers.error();
    failure_ = words_of(first_error_, bad_input_);
    stopping_ = true;
  }

  /// Records an error of this rank, or the user's wish to stop.
  void notice(const Workers& workers) {
    notice_error(workers);
    if (settings_.stop && settings_.stop()) {
      results_.stopped = true;
      stopping_ = true;
    }
  }

  void hear(const Message& message, int& others) {
    auto notice = from_bytes<Notice>(message.bytes);
    done_elsewhere_ += notice.done;
    const std::lock_guard lock(mutex_);
    for (Parcel& parcel : notice.parcels) keep(std::move(parcel));
    switch (notice.word) {
      case Word::kWant:
        answer(message.from, notice.wanted);
        break;
      case Word::kFailed:
        if (failure_.empty()) {
          failure_ = notice.error;
          bad_input_ = notice.bad_input;
        }
        stopping_ = true;
        break;
      default:
        --others;
    }
  }

  void answer(int to, std::int64_t wanted) {
    const Chunk chunk = next(wanted);
    const Word word = !chunk.empty() ? Word::kChunk : stopping_ ? Word::kStop : Word::kNoMore;
    world_.send(to, Channel::kTasks, to_bytes(Answer{word, chunk}));
  }

  /// Shares the outcome with all ranks, and the results if requested.
  void share_end() {
    if (world_.size() == 1) {
      if (first_error_) std::rethrow_exception(first_error_);
      return;
    }
    agree(world_, world_.is_root() ? failure_ : "", bad_input_);
    read_bytes(broadcast(world_, to_bytes(results_.finished, results_.computed, results_.stopped)),
               results_.finished, results_.computed, results_.stopped);
    if (!settings_.everywhere) return;
    ListResults all(static_cast<std::size_t>(list_.count));
    if (world_.is_root())
      results_.for_each([&](std::int64_t number, std::string&& bytes) {
        all[static_cast<std::size_t>(number)] = std::move(bytes);
      });
    const std::string bytes = broadcast(world_, to_bytes(all));
    if (world_.is_root()) return;
    results_.folder_.clear();
    read_bytes(bytes, results_.kept_);
  }

  World& world_;
  const TaskList& list_;
  const RunSettings& settings_;
  Results results_;
  std::unique_ptr<JournalWriter> journal_;
  std::unique_ptr<Chunks> chunks_;
  std::mutex mutex_;
  std::vector<Parcel> parcels_;  ///< results not yet sent to rank 0
  std::atomic<std::int64_t> unsent_{0};
  std::int64_t done_elsewhere_ = 0;  ///< tasks of this run over all ranks
  bool stopping_ = false;
  std::exception_ptr first_error_;
  std::string failure_;
  bool bad_input_ = false;
};

void Results::for_each(const std::function<void(std::int64_t, std::string&&)>& take) const {
  auto stopped_task = stopped_tasks_;
  std::sort(stopped_task.begin(), stopped_task.end());
  auto next_stopped = stopped_task.begin();
  const auto with_stopped = [&](std::int64_t number, std::string&& result) {
    for (; next_stopped != stopped_task.end() && next_stopped->first < number; ++next_stopped)
      take(next_stopped->first, std::move(next_stopped->second));
    if (number < count) take(number, std::move(result));
  };
  if (!folder_.empty()) {
    JournalReader(folder_, list_).for_each(with_stopped);
  } else {
    for (std::size_t i = 0; i < kept_.size(); ++i)
      if (kept_[i]) with_stopped(static_cast<std::int64_t>(i), std::string(*kept_[i]));
  }
  with_stopped(count, {});
}

Results run_tasks(World& world, const TaskList& list, const RunSettings& settings) {
  return TaskRun(world, list, settings).run();
}

}  // namespace counterpoint::apps::tasks
