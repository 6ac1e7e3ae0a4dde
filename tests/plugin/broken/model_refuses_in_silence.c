/* V04: has a largest stiffness that its table does not know, and no sentence for it. */
#define ON_CREATE              \
  if (net->stiffness > 9000) { \
    destroy(net);              \
    return DFM_E_ARG;          \
  }
#include "net.h"
