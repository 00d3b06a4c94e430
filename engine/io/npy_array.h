// NumPy's .npy arrays, format version 1.0 and later (numpy.lib.format).
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/io/zip_archive.h"

namespace counterpoint {

/// Returns the header of a rows x columns array; it always has the same length. `type`: "<f8",
/// "<u8".
std::string npy_header(const std::string& type, std::size_t rows, std::size_t columns);
/// Returns names as an array of strings, `width` per row (1: one-dimensional).
std::string npy_strings(const std::vector<std::string>& names, std::size_t width);

struct NpyHeader {
  std::string type;
  bool fortran_order = false;
  std::vector<std::size_t> shape;
};
/// Reads the header of an array. @throws InputError describing the error, without the file's name.
NpyHeader read_npy_header(ZipEntry& entry);
/// Reads an array of strings of type '<U' or '|S', `width` per row. @throws InputError as
/// read_npy_header.
std::vector<std::string> read_npy_strings(ZipEntry& entry, std::size_t width);

}  // namespace counterpoint
