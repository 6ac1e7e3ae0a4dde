/* V03: no id is in reverse-DNS form that breaks a line. */
#define ID "org\nbroken.law"
#include "law.h"
