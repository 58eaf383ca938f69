//! Clears the images' memory before anything runs: after power-up its check bits are as random as its bytes, and reading
//! would be taken for an error.

use core::arch::global_asm;

// What cortex-m-rt calls before it lays out variables: no stack, no variable, r0 to r3 free.
global_asm!(
    ".section .text.clear_images, \"ax\"",
    ".global clear_images",
    ".type clear_images,%function",
    ".thumb_func",
    "clear_images:",
    "ldr r0, =__simages",
    "ldr r1, =__eimages",
    "movs r2, #0",
    "0:",
    "cmp r0, r1",
    "bhs 1f",
    "stmia r0!, {{r2}}",
    "b 0b",
    "1:",
    "bx lr",
    ".ltorg",
);
