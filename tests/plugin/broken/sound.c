/* Nothing is wrong with it: what the broken laws are made from must keep every rule, or they would
 * prove nothing. */
#include "law.h"
