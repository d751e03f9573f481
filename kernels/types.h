// Every struct that crosses between host and device: float, uint and float4 only, sizes in multiples of 16 bytes.
#ifndef PARIAN_TYPES_H
#define PARIAN_TYPES_H
#include "portable.h"

KERNEL_HEADER_BEGIN

// One channel of a medium, ready for bssrdf.h; lengths in transport mean free paths (1/sigma_t') of that channel.
// What z_v, fluence and scale stand for depends on the model (see bssrdf.h); ior-dependent factors are inside.
//   sigma_t_prime  reduced extinction per unit of the positions passed in
//   sigma_tr       effective transport coefficient
//   d_e            extrapolation length (FHK 21)
//   z_v            distance of the virtual source from the boundary
//   a_back         squared distance offset of backlit points (FHK 25)
//   fluence        weight of the fluence term: C_phi / D
//   C_E            weight of the flux term
//   scale          everything constant in front of the dipole, sigma_t'^2 included
#define MEDIUM_FIELDS(T) T sigma_t_prime, sigma_tr, d_e, z_v, a_back, fluence, C_E, scale;
typedef struct {
  MEDIUM_FIELDS(float)
} Medium;

// Refraction at the boundary; eta_sq_minus_1 comes from double precision, since it cancels near eta = 1.
#define BOUNDARY_FIELDS(T) T eta_sq, eta_sq_minus_1, pad_0, pad_1;
typedef struct {
  BOUNDARY_FIELDS(float)
} Boundary;

#ifdef __cplusplus
// The same constants unrounded, for the double form.
typedef struct {
  MEDIUM_FIELDS(double)
} ExactMedium;
typedef struct {
  BOUNDARY_FIELDS(double)
} ExactBoundary;
static_assert(sizeof(Medium) == 32 && sizeof(Boundary) == 16);
#endif

KERNEL_HEADER_END
#endif
