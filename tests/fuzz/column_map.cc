// Column maps of `compare`, and a recording read through each.
#include "counterpoint/engine/estimate/recording.h"
#include "fuzz/fuzz.h"
#include "fuzz/small_model.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  const Model& model = small_model();
  static const std::filesystem::path table =
      write("recording.csv", "t,a,b,c,d,e,f,g\n0,1,2,3,1,0,0,0\n0.1,1,2,3,1,0,0,0\n");
  const estimation::ColumnMap map = estimation::load_column_map(write("map.yaml", input), model);
  for (const estimation::Recording& recording :
       estimation::read_recordings(table, map, model, model.default_q(), VectorX::Zero(model.nv())))
    if (!recording.q.allFinite() || !recording.v.allFinite()) std::abort();
}

}  // namespace counterpoint::fuzz
