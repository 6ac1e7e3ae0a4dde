/* V03: promises a word that nobody knows. */
#define EFFECTS "stictoin"
#include "law.h"
