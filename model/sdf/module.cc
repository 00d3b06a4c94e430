#include "counterpoint/model/sdf/reader.h"

extern "C"
    [[gnu::visibility("default")]] const counterpoint::sdf_file::Reader COUNTERPOINT_MODULE = {
        counterpoint::sdf_file::read_model, counterpoint::sdf_file::read_tags};
