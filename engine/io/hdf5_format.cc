// Tables as HDF5: datasets `numbers` (rows x columns) with names in `columns`, `integers` with
// names in `integer_columns`, and `labels` (pairs of a column's name and a label). Written in SWMR
// mode (single writer, multiple readers): others can read meanwhile, and the file stays readable if
// the writer dies.
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <stdexcept>

#include "counterpoint/engine/io/table_format.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

constexpr hsize_t kMaxChunk = 256'000'000;  // bytes; the library keeps one chunk in memory
/// Attempts to read metadata that another process may be writing; the library waits from 1 ns on,
/// twice as long each time.
constexpr unsigned kReadAttempts = 20;

/// Serializes access to the library, which is not thread-safe, and silences its messages: ours name
/// the file.
class Library {
 public:
  Library() : lock_(mutex()) {
    H5PLset_loading_state(0);  // files must not load code (plugins)
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Library() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  std::lock_guard<std::mutex> lock_;
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

/// An object of the library, closed by the destructor.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle() = default;
  Handle(hid_t id, Close how) : id_(id), close_(how) {}
  Handle(Handle&& other) noexcept : id_(other.id_), close_(other.close_) { other.id_ = -1; }
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() { close(); }
  bool close() {
    const bool closed = id_ < 0 || close_(id_) >= 0;
    id_ = -1;
    return closed;
  }
  hid_t id() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

Handle property_list(hid_t kind) { return {H5Pcreate(kind), H5Pclose}; }

Handle string_type(std::size_t length) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(1, length));
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return type;
}

class Hdf5Sink final : public TableSink {
 public:
  Hdf5Sink(const std::filesystem::path& file, const std::vector<Column>& columns)
      : name_(file.string()) {
    const Library library;
    const Handle access = property_list(H5P_FILE_ACCESS), root = property_list(H5P_FILE_CREATE);
    H5Pset_libver_bounds(access.id(), H5F_LIBVER_V110, H5F_LIBVER_V110);
    H5Pset_obj_track_times(root.id(), false);  // equal content gives equal bytes
    file_ = {H5Fcreate(name_.c_str(), H5F_ACC_TRUNC, root.id(), access.id()), H5Fclose};
    if (!file_.valid())
      throw InputError(fmt::format(
          "{}: cannot be created; expected a path in an existing, writable folder", name_));
    const std::vector<std::string> numbers = names_of(columns, false),
                                   integers = names_of(columns, true);
    std::vector<std::string> labels;
    for (const Column& column : columns)
      for (const std::string& label : column.labels)
        labels.insert(labels.end(), {column.name, label});
    write_strings("columns", numbers, 1);
    if (!integers.empty()) write_strings("integer_columns", integers, 1);
    if (!labels.empty()) write_strings("labels", labels, 2);
    numbers_ = create("numbers", numbers.size(), columns.size(), H5T_IEEE_F64LE);
    if (!integers.empty())
      integers_ = create("integers", integers.size(), columns.size(), H5T_STD_U64LE);
    width_ = {numbers.size(), integers.size()};
    check(H5Fstart_swmr_write(file_.id()) >= 0);
  }
  ~Hdf5Sink() override {
    const Library library;
    close();
  }

  void write(const TableBlock& block) override {
    const Library library;
    const auto rows = static_cast<hsize_t>(block.rows);
    append(numbers_, rows, width_[0], H5T_NATIVE_DOUBLE, block.numbers.data());
    if (width_[1] > 0) append(integers_, rows, width_[1], H5T_NATIVE_UINT64, block.integers.data());
    rows_ += rows;
  }

  void finish() override {
    const Library library;
    check(close());
  }

 private:
  bool close() {
    const bool numbers = numbers_.close(), integers = integers_.close();
    return file_.close() && numbers && integers;
  }

  void check(bool succeeded) const {
    if (!succeeded)
      throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", name_));
  }

  void write_strings(const char* name, const std::vector<std::string>& texts, hsize_t width) {
    std::size_t length = 1;
    for (const std::string& text : texts) length = std::max(length, text.size());
    std::string bytes(length * texts.size(), '\0');
    for (std::size_t i = 0; i < texts.size(); ++i)
      std::copy(texts[i].begin(), texts[i].end(), bytes.begin() + static_cast<long>(i * length));
    const hsize_t dims[] = {texts.size() / width, width};
    const Handle type = string_type(length);
    const Handle space(H5Screate_simple(width == 1 ? 1 : 2, dims, nullptr), H5Sclose);
    const Handle layout = property_list(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(layout.id(), false);
    const Handle set(
        H5Dcreate2(file_.id(), name, type.id(), space.id(), H5P_DEFAULT, layout.id(), H5P_DEFAULT),
        H5Dclose);
    check(H5Dwrite(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) >= 0);
  }

  Handle create(const char* name, hsize_t width, std::size_t columns, hid_t type) {
    const hsize_t dims[] = {0, width}, most[] = {H5S_UNLIMITED, width};
    const hsize_t chunk[] = {static_cast<hsize_t>(rows_of_block(columns)), width};
    const Handle space(H5Screate_simple(2, dims, most), H5Sclose);
    const Handle layout = property_list(H5P_DATASET_CREATE);
    H5Pset_chunk(layout.id(), 2, chunk);
    H5Pset_obj_track_times(layout.id(), false);
    Handle set(
        H5Dcreate2(file_.id(), name, type, space.id(), H5P_DEFAULT, layout.id(), H5P_DEFAULT),
        H5Dclose);
    check(set.valid());
    return set;
  }

  void append(const Handle& set, hsize_t rows, hsize_t width, hid_t type, const void* data) {
    const hsize_t extent[] = {rows_ + rows, width}, start[] = {rows_, 0}, count[] = {rows, width};
    check(H5Dset_extent(set.id(), extent) >= 0);
    const Handle place(H5Dget_space(set.id()), H5Sclose),
        memory(H5Screate_simple(2, count, nullptr), H5Sclose);
    H5Sselect_hyperslab(place.id(), H5S_SELECT_SET, start, nullptr, count, nullptr);
    check(H5Dwrite(set.id(), type, memory.id(), place.id(), H5P_DEFAULT, data) >= 0 &&
          H5Dflush(set.id()) >= 0);
  }

  std::string name_;
  Handle file_, numbers_, integers_;
  std::vector<hsize_t> width_;
  hsize_t rows_ = 0;
};

class Hdf5Source final : public TableSource {
 public:
  explicit Hdf5Source(const std::filesystem::path& file) : name_(file.string()) {
    const Library library;
    file_ = {H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose};
    if (!file_.valid()) {  // still being written, or its writer died
      const Handle access = property_list(H5P_FILE_ACCESS);
      H5Pset_metadata_read_attempts(access.id(), kReadAttempts);
      file_ = {H5Fopen(name_.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.id()), H5Fclose};
    }
    if (!file_.valid()) fail("damaged: the HDF5 library cannot open it");
    const std::vector<std::string> names = strings("columns", 1, true);
    const std::vector<std::string> integer_names = strings("integer_columns", 1, false);
    columns_ = columns_of(names, integer_names, strings("labels", 2, false), name_);
    if (names.empty()) fail("no names in 'columns'");
    width_ = {names.size(), integer_names.size()};
    numbers_ = open("numbers", H5T_FLOAT, width_[0]);
    if (width_[1] > 0) {
      const hsize_t rows = rows_;
      integers_ = open("integers", H5T_INTEGER, width_[1]);
      rows_ = std::min(rows, rows_);  // the last rows of a writer that died may lack integers
    }
  }
  ~Hdf5Source() override {
    const Library library;
    integers_.close();
    numbers_.close();
    file_.close();
  }

  bool read(TableBlock& block) override {
    const Library library;
    const hsize_t rows =
        std::min(rows_ - read_, static_cast<hsize_t>(rows_of_block(columns_.size())));
    if (rows == 0) return false;
    block.numbers.resize(rows * width_[0]);
    block.integers.resize(rows * width_[1]);
    get(numbers_, rows, width_[0], H5T_NATIVE_DOUBLE, block.numbers.data());
    if (width_[1] > 0) get(integers_, rows, width_[1], H5T_NATIVE_UINT64, block.integers.data());
    read_ += rows;
    block.rows = static_cast<int>(rows);
    return true;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format(
        "{}: {}; expected what counterpoint writes: datasets 'numbers' (rows x columns, "
        "float64) and 'columns' (their names)",
        name_, what));
  }

  /// Opens a dataset stored in this file itself, not through links; invalid handle: there is none.
  Handle dataset(const char* name) const {
    H5L_info_t link;
    if (H5Lexists(file_.id(), name, H5P_DEFAULT) <= 0 ||
        H5Lget_info(file_.id(), name, &link, H5P_DEFAULT) < 0)
      return {};
    if (link.type != H5L_TYPE_HARD)
      fail(fmt::format("'{}' is a link, which may lead to other files", name));
    Handle set(H5Dopen2(file_.id(), name, H5P_DEFAULT), H5Dclose);
    if (!set.valid()) fail(fmt::format("'{}' is no dataset", name));
    const Handle layout(H5Dget_create_plist(set.id()), H5Pclose);
    if (!layout.valid()) fail(fmt::format("'{}' is damaged", name));
    if (H5Pget_external_count(layout.id()) != 0 || H5Pget_layout(layout.id()) == H5D_VIRTUAL)
      fail(fmt::format("'{}' lies in other files", name));
    hsize_t chunk[H5S_MAX_RANK];
    if (H5Pget_layout(layout.id()) == H5D_CHUNKED) {
      const int rank = H5Pget_chunk(layout.id(), H5S_MAX_RANK, chunk);
      hsize_t cells = 1;
      for (int i = 0; i < rank; ++i)
        cells = std::min(cells * std::min(chunk[i], kMaxChunk), kMaxChunk);
      if (rank < 0 || cells * 8 > kMaxChunk)
        fail(fmt::format("'{}' has chunks of more than 256 MB", name));
    }
    for (int i = 0; i < H5Pget_nfilters(layout.id()); ++i) {
      std::size_t values = 0;
      const H5Z_filter_t filter = H5Pget_filter2(layout.id(), static_cast<unsigned>(i), nullptr,
                                                 &values, nullptr, 0, nullptr, nullptr);
      if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE &&
          filter != H5Z_FILTER_FLETCHER32)
        fail(fmt::format("'{}' is packed by filter {}; gzip and shuffle are read", name, filter));
    }
    return set;
  }

  std::vector<hsize_t> shape_of(const Handle& set, const char* name) const {
    const Handle space(H5Dget_space(set.id()), H5Sclose);
    const int rank = H5Sget_simple_extent_ndims(space.id());
    if (rank < 1 || rank > 2) fail(fmt::format("'{}' has {} dimensions", name, rank));
    std::vector<hsize_t> shape(static_cast<std::size_t>(rank));
    H5Sget_simple_extent_dims(space.id(), shape.data(), nullptr);
    return shape;
  }

  Handle open(const char* name, H5T_class_t kind, hsize_t width) {
    Handle set = dataset(name);
    if (!set.valid()) fail(fmt::format("no dataset '{}'", name));
    const std::vector<hsize_t> shape = shape_of(set, name);
    if (shape.size() != 2 || shape[1] != width)
      fail(fmt::format("'{}' does not have the {} columns that are named", name, width));
    const Handle type(H5Dget_type(set.id()), H5Tclose);
    const bool is_signed = kind == H5T_INTEGER && H5Tget_sign(type.id()) != H5T_SGN_NONE;
    if (H5Tget_class(type.id()) != kind || H5Tget_size(type.id()) != 8 || is_signed)
      fail(fmt::format("'{}' is not of type {}", name, kind == H5T_FLOAT ? "float64" : "uint64"));
    rows_ = shape[0];
    return set;
  }

  std::vector<std::string> strings(const char* name, std::size_t width, bool needed) const {
    const Handle set = dataset(name);
    if (!set.valid() && needed) fail(fmt::format("no dataset '{}'", name));
    if (!set.valid()) return {};
    const std::vector<hsize_t> shape = shape_of(set, name);
    const Handle type(H5Dget_type(set.id()), H5Tclose);
    if (H5Tget_class(type.id()) != H5T_STRING || shape.size() != width ||
        (width == 2 && shape[1] != 2))
      fail(fmt::format("'{}' is not a list of names", name));
    const hsize_t count = shape[0] * width;
    if (shape[0] > kMaxColumns) fail(fmt::format("'{}' holds {} names", name, count));
    return H5Tis_variable_str(type.id()) > 0 ? variable_strings(set, type, count, name)
                                             : fixed_strings(set, type, count, name);
  }

  std::vector<std::string> fixed_strings(const Handle& set, const Handle& type, hsize_t count,
                                         const char* name) const {
    const std::size_t length = H5Tget_size(type.id());
    if (length == 0 || length * count > limits::kMaxTableLine)
      fail(fmt::format("'{}' holds names of more than 64 MB", name));
    std::string bytes(length * count, '\0');
    if (H5Dread(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) < 0)
      fail(fmt::format("'{}' is damaged", name));
    std::vector<std::string> texts;
    for (hsize_t i = 0; i < count; ++i) {
      const char* const text = bytes.data() + i * length;
      texts.emplace_back(text, strnlen(text, length));
    }
    return texts;
  }

  /// Reads variable-length strings, which h5py writes.
  std::vector<std::string> variable_strings(const Handle& set, const Handle& type, hsize_t count,
                                            const char* name) const {
    std::vector<char*> pointers(count, nullptr);
    const Handle space(H5Dget_space(set.id()), H5Sclose);
    if (H5Dread(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers.data()) < 0)
      fail(fmt::format("'{}' is damaged", name));
    std::vector<std::string> texts;
    for (const char* text : pointers) texts.emplace_back(text ? text : "");
    H5Dvlen_reclaim(type.id(), space.id(), H5P_DEFAULT, pointers.data());
    return texts;
  }

  void get(const Handle& set, hsize_t rows, hsize_t width, hid_t type, void* data) const {
    const hsize_t start[] = {read_, 0}, count[] = {rows, width};
    const Handle place(H5Dget_space(set.id()), H5Sclose),
        memory(H5Screate_simple(2, count, nullptr), H5Sclose);
    if (H5Sselect_hyperslab(place.id(), H5S_SELECT_SET, start, nullptr, count, nullptr) < 0 ||
        H5Dread(set.id(), type, memory.id(), place.id(), H5P_DEFAULT, data) < 0)
      fail(fmt::format("damaged: rows from {} on cannot be read", read_ + 1));
  }

  std::string name_;
  Handle file_, numbers_, integers_;
  std::vector<hsize_t> width_;
  hsize_t rows_ = 0, read_ = 0;
};

std::unique_ptr<TableSource> open(const std::filesystem::path& file) {
  return std::make_unique<Hdf5Source>(file);
}

std::unique_ptr<TableSink> create(const std::filesystem::path& file,
                                  const std::vector<Column>& columns) {
  return std::make_unique<Hdf5Sink>(file, columns);
}

}  // namespace
}  // namespace counterpoint

extern "C" [[gnu::visibility("default")]] const counterpoint::Hdf5Format COUNTERPOINT_MODULE = {
    counterpoint::open, counterpoint::create};
