"""A substitute for a language model: it changes a number of the program that it reads."""

import random
import re

CHANCE = random.Random(7)


def mutated(program: str) -> str:
    """The program with another value of one of its constants, now and then with a mistake."""
    [*numbers] = re.finditer(r"(?<= = )-?[\d.]+$", program, re.MULTILINE)
    chosen = CHANCE.choice(numbers)
    value = "robots.nothing" if CHANCE.random() < 0.2 else f"{CHANCE.uniform(0, 6):.2f}"
    return program[: chosen.start()] + value + program[chosen.end() :]


class Model:
    """The interface of OpenEvolve's models."""

    async def generate(self, prompt: str, **options: object) -> str:
        return self.answer(prompt)

    async def generate_with_context(self, system_message: str, messages: list[dict[str, str]], **options: object) -> str:
        return self.answer(messages[-1]["content"])

    def answer(self, prompt: str) -> str:
        programs = [it for it in re.findall(r"```\w*\n(.*?)```", prompt, re.DOTALL) if "def control" in it]
        return f"```python\n{mutated(programs[-1])}\n```"


def model(_: object) -> Model:
    """What OpenEvolve calls in each of its processes."""
    return Model()
