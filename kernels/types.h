// Every struct that crosses between host and device: float, uint and float4 only, sizes in multiples of 16 bytes.
#ifndef PARIAN_TYPES_H
#define PARIAN_TYPES_H
#include "portable.h"

KERNEL_HEADER_BEGIN

// One channel of a medium, ready for bssrdf.h; lengths in transport mean free paths (1/sigma_t') of that channel.
// What z_v, flux and C_E stand for depends on the model that the kernels are built with (see bssrdf.h).
typedef struct {
  float sigma_t_prime;  // reduced extinction per unit of the positions passed in
  float sigma_tr;       // effective transport coefficient
  float d_e;            // extrapolation length (FHK 21)
  float z_v;            // height of the virtual source
  float a_back;         // squared distance offset of backlit points (FHK 25)
  float flux;           // weight of the fluence term: 3 C_phi(eta), or C_phi / D
  float C_E;            // weight of the flux term
  float scale;          // everything constant in front of the dipole, sigma_t'^2 included
} Medium;

// Refraction at the boundary; eta_sq_minus_1 comes from double precision, since it cancels near eta = 1.
typedef struct {
  float eta;
  float inv_eta;
  float eta_sq_minus_1;
  float pad;
} Boundary;

KERNEL_HEADER_END
#endif
