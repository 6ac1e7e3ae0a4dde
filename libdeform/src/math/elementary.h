// exp, log, pow and sines for code that runs in a step: the functions that plugins use too.
#pragma once
#include "deform/elementary.h"
