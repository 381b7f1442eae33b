/* Starts programs on the emulated board mps2-an386: the vectors, and the floating-point unit. */
    .syntax unified
    .cpu cortex-m4
    .fpu fpv4-sp-d16
    .thumb
    .section .vectors, "a"
    .word 0x20400000
    .word reset
    .text
    .thumb_func
    .global reset
reset:
    /* Full access to coprocessors 10 and 11, in CPACR. */
    ldr r0, =0xe000ed88
    ldr r1, [r0]
    orr r1, r1, #0xf00000
    str r1, [r0]
    dsb
    isb
    b _start
