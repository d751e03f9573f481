// The module's one symbol.
#include "io/pictures/pictures.hpp"

extern "C" [[gnu::visibility("default")]] const parian::pictures::Functions parian_pictures;

const parian::pictures::Functions parian_pictures{parian::pictures::check_format, parian::pictures::png_base64,
                                                  parian::pictures::write, parian::pictures::read,
                                                  parian::pictures::read_notes};
