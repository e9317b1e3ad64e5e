// Integrals of the density, and of the density times position and squared distance, about some origin.
struct Moments {
  real mass;
  real3 first;
  real second;
};
