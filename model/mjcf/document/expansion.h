// <replicate> and <attach>: what they stand for, written out.
#pragma once

namespace counterpoint::mjcf {

class Document;

/// Puts copies in place of every <replicate>, and the parts of other models in place of every
/// <attach>, with the elements outside of the bodies that name them (MuJoCo, XML Reference,
/// "replicate" and "body/attach"). Reads the <compiler> of every model. @throws InputError naming
/// what cannot be replicated or attached.
void expand(Document& document);

}  // namespace counterpoint::mjcf
