#include "counterpoint/engine/sensors/carried_part.h"

namespace counterpoint {
namespace {

/// Whether `frame` is `root` or hangs on it by welds alone.
bool hangs_on(const Model& model, int frame, int root) {
  while (frame != root) {
    if (!is_welded(model, frame)) return false;
    frame = model.frames()[static_cast<std::size_t>(frame)].parent;
    if (frame < 0) return false;
  }
  return true;
}

}  // namespace

CarriedPart carried_part(const Model& model, int frame) {
  CarriedPart part;
  part.has_link.assign(model.frames().size(), 0);
  if (frame >= 0) {
    part.body = model.frames()[static_cast<std::size_t>(frame)].body;
    part.welded = is_welded(model, frame);
    for (std::size_t i = 0; i < model.frames().size(); ++i) {
      const Frame& link = model.frames()[i];
      if (link.body != part.body || !hangs_on(model, static_cast<int>(i), frame)) continue;
      part.has_link[i] = 1;
      part.share = part.share + link.inertia.transformed(link.X_BF);
    }
    // The body of a joint has inertia of its own if it was filled in or edited.
    if (!part.welded) part.share = model.body(part.body).inertia;
  }
  for (int b = 1; b < model.num_bodies(); ++b) {
    if (model.body(b).parent != part.body) continue;
    const int link = model.find_frame(model.joint(b - 1).link);
    const int above = link < 0 ? -1 : model.frames()[static_cast<std::size_t>(link)].parent;
    if (frame < 0 || (above >= 0 && part.has_link[static_cast<std::size_t>(above)]))
      part.children.push_back(b);
  }
  return part;
}

}  // namespace counterpoint
