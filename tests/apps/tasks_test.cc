// Task lists: each task is done exactly once by any set of workers, and finished tasks survive.
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>

#include "counterpoint/model/spatial.h"
#include "tasks/archive.h"
#include "tasks/chunks.h"
#include "tasks/journal.h"
#include "tasks/run_tasks.h"
#include "tasks/task_list.h"

namespace counterpoint::apps::tasks::tasks_test {
namespace {

namespace fs = std::filesystem;

class Tasks : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("counterpoint_tasks_" + std::string(info->name()) + std::to_string(getpid()));
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// A list whose task i returns 3 i as text and counts its calls.
  TaskList thrice(std::int64_t count) {
    TaskList list;
    list.name = "thrice";
    list.count = count;
    list.fingerprint = 7;
    list.make_task = [this]() -> Task {
      return [this](std::int64_t i) {
        ++calls_;
        return Outcome{std::to_string(3 * i), true};
      };
    };
    return list;
  }
  static std::vector<std::string> all(const Results& results) {
    std::vector<std::string> out;
    results.for_each([&](std::int64_t, std::string&& bytes) { out.push_back(std::move(bytes)); });
    return out;
  }
  fs::path one_journal() const { return fs::directory_iterator(folder_)->path(); }

  fs::path folder_;
  std::atomic<int> calls_{0};
};

std::multiset<std::int64_t> handed_out(Chunks chunks, int ranks) {
  std::multiset<std::int64_t> numbers;
  for (int wanted = 1;; wanted = wanted % 7 + 1) {
    const Chunk chunk = chunks.next(wanted, ranks);
    if (chunk.empty()) break;
    EXPECT_LE(chunk.count, wanted);
    for (std::int64_t i = 0; i < chunk.count; ++i) numbers.insert(chunk.first + i * chunk.stride);
  }
  EXPECT_EQ(chunks.left(), 0);
  return numbers;
}

TEST_F(Tasks, SharesPartitionTheList) {
  for (const std::int64_t count : {0, 1, 2, 5, 100}) {
    for (const std::int64_t of : {1, 3, 7}) {
      std::multiset<std::int64_t> numbers;
      for (std::int64_t k = 0; k < of; ++k)
        numbers.merge(handed_out(Chunks(count, {k, of}, {}), 2));
      EXPECT_EQ(static_cast<std::int64_t>(numbers.size()), count);
      EXPECT_EQ(std::set<std::int64_t>(numbers.begin(), numbers.end()).size(), numbers.size());
    }
  }
}

TEST_F(Tasks, WhatIsDoneIsNotHandedOut) {
  std::vector<bool> done(10, false);
  done[0] = done[3] = done[9] = true;
  EXPECT_EQ(handed_out(Chunks(10, {}, done), 1),
            (std::multiset<std::int64_t>{1, 2, 4, 5, 6, 7, 8}));
  EXPECT_EQ(handed_out(Chunks(10, {1, 2}, done), 1), (std::multiset<std::int64_t>{1, 5, 7}));
}

TEST_F(Tasks, ChunksShrinkTowardsTheEnd) {
  Chunks chunks(900, {}, {});
  EXPECT_EQ(chunks.next(1000, 3).count, 100);  // a third of an even share
  EXPECT_EQ(chunks.next(1000, 3).count, 88);
  while (chunks.left() > 5) chunks.next(1000, 3);
  EXPECT_EQ(chunks.next(1000, 3).count, 1);
}

TEST_F(Tasks, ResultsDoNotDependOnThreads) {
  const auto world = lone_world();
  RunSettings settings;
  settings.threads = 1;
  const std::vector<std::string> one = all(run_tasks(*world, thrice(1000), settings));
  ASSERT_EQ(one.size(), 1000u);
  EXPECT_EQ(one[999], "2997");
  for (const int threads : {2, 3, 16}) {
    settings.threads = threads;
    EXPECT_EQ(all(run_tasks(*world, thrice(1000), settings)), one) << threads;
  }
  EXPECT_EQ(calls_, 4000);
}

TEST_F(Tasks, JournalsHoldWhatIsDoneAndARerunDoesTheRest) {
  const auto world = lone_world();
  RunSettings settings;
  settings.threads = 2;
  settings.folder = folder_;
  settings.share = {1, 3};
  const Results share = run_tasks(*world, thrice(100), settings);
  EXPECT_FALSE(share.complete());
  EXPECT_EQ(share.computed, 33);
  EXPECT_EQ(all(share).front(), "3");
  settings.share = {};
  const Results rest = run_tasks(*world, thrice(100), settings);
  EXPECT_TRUE(rest.complete());
  EXPECT_EQ(rest.computed, 67);
  EXPECT_EQ(calls_, 100);
  const Results again = run_tasks(*world, thrice(100), settings);
  EXPECT_EQ(again.computed, 0);
  EXPECT_EQ(all(again).size(), 100u);
  EXPECT_EQ(all(again)[99], "297");
}

TEST_F(Tasks, ARecordCutOffAtAnyByteCountsAsNotDone) {
  {
    JournalWriter writer(folder_, thrice(10));
    for (const int i : {4, 5, 6}) writer.add(i, std::to_string(3 * i));
  }
  const fs::path file = one_journal();
  const auto whole = fs::file_size(file);
  // A header of 24 bytes and records of 16 + 2.
  ASSERT_EQ(whole, 24u + 3 * 18u);
  for (auto size = whole; size-- > 0;) {
    fs::resize_file(file, size);
    EXPECT_EQ(JournalReader(folder_, thrice(10)).num_done(),
              size < 24 ? 0 : static_cast<std::int64_t>((size - 24) / 18))
        << size;
  }
}

TEST_F(Tasks, ADamagedByteIsNoticed) {
  {
    JournalWriter writer(folder_, thrice(10));
    writer.add(4, "12");
  }
  const fs::path file = one_journal();
  {
    std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(-1, std::ios::end);
    stream.put('3');
  }
  EXPECT_EQ(JournalReader(folder_, thrice(10)).num_done(), 0);
}

TEST_F(Tasks, ResultsOfSomethingElseAreRefused) {
  { JournalWriter(folder_, thrice(10)).add(1, "3"); }
  TaskList other = thrice(10);
  other.fingerprint = 8;
  EXPECT_THROW(JournalReader(folder_, other), InputError);
  EXPECT_THROW(JournalReader(folder_, thrice(11)), InputError);
  other = thrice(11);
  other.name = "another phase";
  EXPECT_EQ(JournalReader(folder_, other).num_done(), 0);
}

TEST_F(Tasks, WhatATaskThrowsEndsTheRunAndKeepsTheOthers) {
  TaskList list = thrice(50);
  list.make_task = []() -> Task {
    return [](std::int64_t i) -> Outcome {
      if (i == 20) throw InputError("no twenty");
      return {std::to_string(i), true};
    };
  };
  const auto world = lone_world();
  RunSettings settings;
  settings.threads = 1;
  settings.folder = folder_;
  EXPECT_THROW(run_tasks(*world, list, settings), InputError);
  EXPECT_EQ(JournalReader(folder_, list).num_done(), 20);
}

TEST_F(Tasks, StopBeginsNoMoreAndKeepsWhatWasCutShortApart) {
  TaskList list = thrice(1000);
  list.make_task = [this]() -> Task {
    return [this](std::int64_t i) {
      const int call = ++calls_;
      return Outcome{std::to_string(i), call < 5};
    };
  };
  const auto world = lone_world();
  RunSettings settings;
  settings.threads = 1;
  settings.stop = [this] { return calls_ >= 5; };
  const Results results = run_tasks(*world, list, settings);
  EXPECT_TRUE(results.stopped);
  EXPECT_EQ(results.finished, 4);
  EXPECT_FALSE(results.complete());
  EXPECT_EQ(static_cast<std::int64_t>(all(results).size()), results.computed);
}

// Planning takes a counter only; a list of these tasks would take 8 TB.
TEST_F(Tasks, ATrillionTasksArePlannedWithoutAList) {
  Chunks chunks(1'000'000'000'000, {2, 3}, {});
  EXPECT_EQ(chunks.left(), 333'333'333'333);
  const Chunk chunk = chunks.next(1000, 1);
  EXPECT_EQ(chunk.first, 2);
  EXPECT_EQ(chunk.stride, 3);
  EXPECT_EQ(chunk.count, 1000);
}

// A million results and one bit for each; no list of tasks is stored.
TEST_F(Tasks, AMillionTasksAreAllDone) {
  TaskList list;
  list.name = "million";
  list.count = 1'000'000;
  std::atomic<std::int64_t> sum{0};
  list.make_task = [&]() -> Task {
    return [&](std::int64_t i) {
      sum += i;
      return Outcome{};
    };
  };
  const auto world = lone_world();
  RunSettings settings;
  settings.threads = 2;
  EXPECT_TRUE(run_tasks(*world, list, settings).complete());
  EXPECT_EQ(sum, 999'999ll * 1'000'000 / 2);
}

TEST_F(Tasks, BytesComeBackAsTheyWere) {
  const std::string bytes =
      to_bytes(1.5, std::string("a\0b", 3), std::vector<double>{-0.0, 1e300}, VectorX::Ones(3));
  double number = 0.0;
  std::string text;
  std::vector<double> numbers;
  VectorX vector;
  read_bytes(bytes, number, text, numbers, vector);
  EXPECT_EQ(number, 1.5);
  EXPECT_EQ(text, std::string("a\0b", 3));
  EXPECT_TRUE(std::signbit(numbers[0]));
  EXPECT_EQ(numbers[1], 1e300);
  EXPECT_EQ(vector, VectorX::Ones(3));
}

TEST_F(Tasks, DamagedBytesGiveAnError) {
  const std::string bytes = to_bytes(std::string("text"), std::vector<double>{1.0, 2.0});
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    std::string text;
    std::vector<double> numbers;
    EXPECT_THROW(read_bytes(bytes.substr(0, size), text, numbers), InputError);
  }
  std::string damaged = bytes;
  damaged[8] = '\x7f';  // the highest byte of the size of the text
  EXPECT_THROW(from_bytes<std::string>(damaged), InputError);
}

}  // namespace
}  // namespace counterpoint::apps::tasks::tasks_test
