// Expansion of <replicate> and <attach>.
#pragma once

namespace counterpoint::mjcf {

class Document;

/// Replaces every <replicate> by copies, and every <attach> by parts of another model, together
/// with the elements outside the bodies that refer to them (MuJoCo, XML Reference, "replicate" and
/// "body/attach"). Reads the <compiler> of every model. @throws InputError naming the element that
/// cannot be replicated or attached.
void expand(Document& document);

}  // namespace counterpoint::mjcf
