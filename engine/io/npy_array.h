// NumPy's .npy arrays, format version 1.0 and later (numpy.lib.format).
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/io/zip_archive.h"

namespace counterpoint {

/// The header of a rows x columns array, always of the same length. `type`: "<f8", "<u8".
std::string npy_header(const std::string& type, std::size_t rows, std::size_t columns);
/// Names as an array of characters, `width` a row (1: a plain list).
std::string npy_strings(const std::vector<std::string>& names, std::size_t width);

struct NpyHeader {
  std::string type;
  bool fortran_order = false;
  std::vector<std::size_t> shape;
};
/// @throws InputError saying what is wrong, without the file's name.
NpyHeader read_npy_header(ZipEntry& entry);
/// Of types '<U' and '|S'. @throws InputError as above.
std::vector<std::string> read_npy_strings(ZipEntry& entry, std::size_t width);

}  // namespace counterpoint
